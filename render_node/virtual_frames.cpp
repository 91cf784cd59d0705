#include "render_node/virtual_frames.h"

namespace fivepipe {
namespace {

// Numbers that jump back this far: the simulation follows a capture_node that was started anew.
constexpr std::uint64_t kStartedAnew = 64;

}  // namespace

VirtualFrame& VirtualFrames::at(std::uint64_t frame) {
  if (!frames_.empty() && frame + kStartedAnew < frames_.rbegin()->first) frames_.clear();
  VirtualFrame& found = frames_[frame];
  if (frames_.size() > kMaxFrames && frames_.begin()->first != frame) frames_.erase(frames_.begin());
  return found;
}

void VirtualFrames::add_collision(std::uint64_t frame, const std::string& object) { at(frame).colliding.insert(object); }

void VirtualFrames::add_state(std::uint64_t frame, std::vector<ObjectPose> poses) {
  VirtualFrame& found = at(frame);
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

}  // namespace fivepipe
