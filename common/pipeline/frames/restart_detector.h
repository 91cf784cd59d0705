// Distinguishes a late frame from a restarted source that counts from 0 again.
#pragma once
#include <cstdint>
#include <optional>

namespace fivepipe::frames {

class RestartDetector {
 public:
  // A source takes longer than this to start, and clocks of cameras and hosts differ by less.
  static constexpr std::int64_t kMinRestart_ns = 200'000'000;

  // Call it for each message. Returns true if the frame number is lower than an earlier one
  // although the capture is later: the caller must forget earlier frames.
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
