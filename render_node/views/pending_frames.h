// Complete hull frames that wait for the simulation's state, in the order in which they completed,
// or in that of their capture.
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
  // In a lossless replay the state always arrives, and an overtaken hull too; a longer wait means
  // that a node has failed.
  static constexpr std::chrono::milliseconds kStateTimeoutLossless{2000};

  bool empty() const { return frames_.empty(); }
  std::size_t size() const { return frames_.size(); }
  const EyeFrames& first() const { return frames_.front(); }  // requires !empty()

  // Adds a frame: as the last one, or by its capture stamp. If it is now the first one, its wait
  // begins.
  void add(EyeFrames eyes, Clock::time_point now, FrameOrder order);
  // Removes and returns the first frame. Call begin_wait() after compositing it. Requires !empty().
  EyeFrames take();
  // Begins the wait of the frame that is now the first one. The time in which the node composited
  // another one does not count, because it received no states meanwhile.
  void begin_wait(Clock::time_point now) { first_since_ = now; }
  void clear() { frames_.clear(); }

  // Returns whether the first frame has waited for the timeout.
  bool is_due(Clock::time_point now, bool lossless) const;
  // Returns whether a newer frame ends the wait of the first one. In a lossless replay it does not.
  bool is_superseded(bool lossless) const { return !lossless && frames_.size() > 1; }

 private:
  std::deque<EyeFrames> frames_;
  Clock::time_point first_since_;  // when the wait of the first frame began
};

}  // namespace fivepipe::render
