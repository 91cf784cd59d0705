// Tells frames that come late from a source that was started anew and counts from 0 again.
#pragma once
#include <cstdint>
#include <optional>

namespace fivepipe::frames {

class FrameOrder {
 public:
  // A source needs longer than this to start; clocks of cameras and hosts differ by less.
  static constexpr std::int64_t kRestartTakes_ns = 200'000'000;

  // To be asked for each message. True where its number is lower than one before, though it was
  // captured later: forget what was.
  bool starts_anew(std::uint64_t frame, std::int64_t capture_stamp_ns) {
    const bool anew = newest_ && frame < newest_->frame &&
                      capture_stamp_ns > newest_->capture_stamp_ns + kRestartTakes_ns;
    if (!newest_ || anew || frame > newest_->frame) newest_ = Stamped{frame, capture_stamp_ns};
    return anew;
  }

 private:
  struct Stamped {
    std::uint64_t frame;
    std::int64_t capture_stamp_ns;
  };
  std::optional<Stamped> newest_;
};

}  // namespace fivepipe::frames
