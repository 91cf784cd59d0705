#include "render_node/virtual_frames.h"

namespace fivepipe::render {

VirtualFrame& VirtualFrames::at(std::uint64_t frame, std::int64_t capture_stamp_ns) {
  if (restart_detector_.is_restart(frame, capture_stamp_ns)) frames_.clear();
  // A frame older than every kept frame has already been composited or dropped.
  if (frames_.size() >= kMaxFrames && frame < frames_.begin()->first) return too_old_ = {};
  VirtualFrame& found = frames_[frame];
  if (frames_.size() > kMaxFrames) frames_.erase(frames_.begin());
  return found;
}

void VirtualFrames::add_collision(std::uint64_t frame, std::int64_t capture_stamp_ns,
                                  const std::string& object) {
  at(frame, capture_stamp_ns).colliding.insert(object);
}

void VirtualFrames::add_state(std::uint64_t frame, std::int64_t capture_stamp_ns,
                              std::vector<ObjectPose> poses) {
  VirtualFrame& found = at(frame, capture_stamp_ns);
  found.poses = std::move(poses);
  found.complete = true;
}

bool VirtualFrames::has(std::uint64_t frame) const {
  const auto found = frames_.find(frame);
  return found != frames_.end() && found->second.complete;
}

const VirtualFrame* VirtualFrames::best_for(std::uint64_t frame) const {
  const VirtualFrame* best = nullptr;
  for (const auto& [number, candidate] : frames_) {
    if (!candidate.complete) continue;
    if (number > frame && best) break;
    best = &candidate;
  }
  return best;
}

}  // namespace fivepipe::render
