// Tells frames that come late from a source that was started anew and counts from 0 again.
#pragma once
#include <cstdint>
#include <optional>

namespace fivepipe::frames {

class RestartDetector {
 public:
  // A source needs longer than this to start; clocks of cameras and hosts differ by less.
  static constexpr std::int64_t kMinRestart_ns = 200'000'000;

  // To be asked for each message. True where its number is lower than one before, though it was
  // captured later: forget what was.
  bool is_restart(std::uint64_t frame, std::int64_t capture_stamp_ns) {
    const bool restarted = newest_ && frame < newest_->frame &&
                           capture_stamp_ns > newest_->capture_stamp_ns + kMinRestart_ns;
    if (!newest_ || restarted || frame > newest_->frame)
      newest_ = FrameStamp{frame, capture_stamp_ns};
    return restarted;
  }

 private:
  struct FrameStamp {
    std::uint64_t frame;
    std::int64_t capture_stamp_ns;
  };
  std::optional<FrameStamp> newest_;
};

}  // namespace fivepipe::frames
