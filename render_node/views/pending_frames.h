// Complete hull frames that wait for the simulation's state, in the order in which they completed.
#pragma once
#include <chrono>
#include <cstddef>
#include <deque>

#include "render_node/views/view_assembler.h"

namespace fivepipe::render {

class PendingFrames {
 public:
  using Clock = std::chrono::steady_clock;

  // A frame waits this long for its state. Then render_node composites it with the previous state
  // and counts it as late_state.
  static constexpr std::chrono::milliseconds kStateTimeout{40};
  // In a lossless replay the state always arrives; a longer wait means that the simulation has
  // failed.
  static constexpr std::chrono::milliseconds kStateTimeoutLossless{2000};

  bool empty() const { return frames_.empty(); }
  std::size_t size() const { return frames_.size(); }
  const EyeFrames& first() const { return frames_.front(); }  // requires !empty()

  void add(EyeFrames eyes, Clock::time_point now);
  // Removes and returns the first frame, and begins the wait of the next one. Requires !empty().
  EyeFrames take(Clock::time_point now);
  void clear() { frames_.clear(); }

  // Returns whether the first frame must not wait any longer: its time is over, or a newer frame is
  // complete. In a lossless replay newer frames wait, too.
  bool is_due(Clock::time_point now, bool lossless) const;

 private:
  std::deque<EyeFrames> frames_;
  Clock::time_point first_since_;  // start of the wait of the first frame
};

}  // namespace fivepipe::render
