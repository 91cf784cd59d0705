#include "render_node/views/pending_frames.h"

#include <utility>

namespace fivepipe::render {

void PendingFrames::add(EyeFrames eyes, Clock::time_point now) {
  if (frames_.empty()) first_since_ = now;
  frames_.push_back(std::move(eyes));
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
