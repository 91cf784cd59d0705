// Distinguishes a late frame from a restarted source that counts from 0 again.
#pragma once
#include <cstdint>
#include <optional>

#include "common/base/realtime.h"

namespace fivepipe::frames {

class RestartDetector {
 public:
  // A source takes longer than this to start, and clocks of cameras and hosts differ by less.
  static constexpr std::int64_t kMinRestart_ns = 200'000'000;

  // After this many messages in a row that contradict the newest frame, that frame counts as wrong,
  // for example that of a stranger. A reader holds 8 samples per key (bus.cpp), so a late reader
  // takes at most 7 lower frames in a row.
  static constexpr int kMaxContradictions = 64;

  // Call it for each message. Returns true if the caller must forget earlier frames: the frame
  // number is lower than an earlier one although the capture is later, or kMaxContradictions
  // messages in a row have a lower number or, with a higher number, an earlier capture.
  bool is_restart(std::uint64_t frame, std::int64_t capture_stamp_ns) {
    const FrameStamp now{frame, capture_stamp_ns};
    if (!newest_) {
      newest_ = now;
      return false;
    }
    const std::int64_t later_by_ns =
        base::difference_ns(capture_stamp_ns, newest_->capture_stamp_ns);
    if (frame >= newest_->frame && later_by_ns >= -kMinRestart_ns) {
      contradictions_ = 0;
      if (frame > newest_->frame) newest_ = now;
      return false;
    }
    const bool restarted = frame < newest_->frame && later_by_ns > kMinRestart_ns;
    if (!restarted && ++contradictions_ < kMaxContradictions) return false;
    newest_ = now;
    contradictions_ = 0;
    return true;
  }

 private:
  struct FrameStamp {
    std::uint64_t frame;
    std::int64_t capture_stamp_ns;
  };
  std::optional<FrameStamp> newest_;
  int contradictions_ = 0;
};

}  // namespace fivepipe::frames
