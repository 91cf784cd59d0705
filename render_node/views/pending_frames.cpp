#include "render_node/views/pending_frames.h"

#include <algorithm>
#include <utility>

namespace fivepipe::render {

void PendingFrames::add(EyeFrames eyes, Clock::time_point now, FrameOrder order) {
  auto next = frames_.end();
  if (order == FrameOrder::capture)
    next = std::find_if(frames_.begin(), frames_.end(), [&](const EyeFrames& frame) {
      return frame.front().capture_stamp_ns > eyes.front().capture_stamp_ns;
    });
  if (next == frames_.begin()) first_since_ = now;
  frames_.insert(next, std::move(eyes));
}

EyeFrames PendingFrames::take() {
  EyeFrames first = std::move(frames_.front());
  frames_.pop_front();
  return first;
}

bool PendingFrames::is_due(Clock::time_point now, bool lossless) const {
  return !frames_.empty() &&
         now - first_since_ >= (lossless ? kStateTimeoutLossless : kStateTimeout);
}

}  // namespace fivepipe::render
