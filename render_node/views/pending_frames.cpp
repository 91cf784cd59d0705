#include "render_node/views/pending_frames.h"

#include <utility>

namespace fivepipe::render {

void PendingFrames::add(EyeFrames eyes, Clock::time_point now) {
  if (frames_.empty()) first_since_ = now;
  frames_.push_back(std::move(eyes));
}

EyeFrames PendingFrames::take(Clock::time_point now) {
  EyeFrames first = std::move(frames_.front());
  frames_.pop_front();
  first_since_ = now;
  return first;
}

bool PendingFrames::is_due(Clock::time_point now, bool lossless) const {
  if (frames_.empty()) return false;
  if (!lossless && frames_.size() > 1) return true;
  return now - first_since_ >= (lossless ? kStateTimeoutLossless : kStateTimeout);
}

}  // namespace fivepipe::render
