// Distinguishes a late frame from a restarted source that counts from 0 again, and from a newest
// frame that was wrong, for example that of a peer.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/base/realtime.h"

namespace fivepipe::frames {

// How the source's restart shows. writer: the messages come from capture_node itself, whose writer
// is another one after a restart (camera_writers.h); their stamps prove nothing, because cameras
// may be slow or badly synchronised. stamp: they come from a node that goes on while capture_node
// restarts; their stamps are those of whole frame sets.
enum class RestartBy { writer, stamp };

class RestartDetector {
 public:
  explicit RestartDetector(RestartBy by) : by_(by) {}

  // A source takes longer than this to start, and clocks of hosts differ by less.
  static constexpr std::int64_t kMinRestart_ns = 200'000'000;

  // If the messages in a row that contradict the newest frame have this many different frame
  // numbers, the newest frame counts as wrong, for example that of a peer. Late messages have at
  // most 8 different frame numbers, the length of a reader's history (bus.cpp), whatever the number
  // of keys.
  static constexpr std::size_t kMaxContradictions = 16;

  // Call it for each message. Returns true if the caller must forget earlier frames: with
  // RestartBy::stamp, if the frame number is lower than an earlier one although the capture is
  // later; with both, if the messages in a row that have a lower number or, with a higher number,
  // an earlier capture are of kMaxContradictions frames.
  bool is_restart(std::uint64_t frame, std::int64_t capture_stamp_ns) {
    const FrameStamp now{frame, capture_stamp_ns};
    if (!newest_) {
      newest_ = now;
      return false;
    }
    const std::int64_t later_by_ns =
        base::difference_ns(capture_stamp_ns, newest_->capture_stamp_ns);
    if (frame >= newest_->frame && later_by_ns >= -kMinRestart_ns) {
      contradicting_.clear();
      if (frame > newest_->frame) newest_ = now;
      return false;
    }
    const bool restarted =
        by_ == RestartBy::stamp && frame < newest_->frame && later_by_ns > kMinRestart_ns;
    if (std::find(contradicting_.begin(), contradicting_.end(), frame) == contradicting_.end())
      contradicting_.push_back(frame);
    if (!restarted && contradicting_.size() < kMaxContradictions) return false;
    newest_ = now;
    contradicting_.clear();
    return true;
  }

 private:
  struct FrameStamp {
    std::uint64_t frame;
    std::int64_t capture_stamp_ns;
  };
  RestartBy by_;
  std::optional<FrameStamp> newest_;
  std::vector<std::uint64_t> contradicting_;  // frames since the last message that agreed
};

}  // namespace fivepipe::frames
