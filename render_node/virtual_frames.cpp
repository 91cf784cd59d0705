#include "render_node/virtual_frames.h"

#include <algorithm>

namespace fivepipe::render {

// Returns nullptr for a displaced frame: it has already been composited or dropped.
VirtualFrame* VirtualFrames::at(std::uint64_t frame, std::int64_t capture_stamp_ns) {
  if (restart_detector_.is_restart(frame, capture_stamp_ns)) frames_.clear();
  return frames_.was_displaced(frame) ? nullptr : &frames_.get_or_add(frame).value;
}

void VirtualFrames::add_collision(std::uint64_t frame, std::int64_t capture_stamp_ns,
                                  const std::string& object) {
  if (VirtualFrame* const found = at(frame, capture_stamp_ns)) found->colliding.insert(object);
}

void VirtualFrames::add_marks(std::uint64_t frame, std::int64_t capture_stamp_ns,
                              CollisionMarks marks) {
  VirtualFrame* const found = at(frame, capture_stamp_ns);
  if (!found) return;
  std::erase_if(found->marks,
                [&](const CollisionMarks& other) { return other.object == marks.object; });
  found->marks.push_back(std::move(marks));
}

void VirtualFrames::add_particles(std::uint64_t frame, std::int64_t capture_stamp_ns,
                                  ParticleCloud particles) {
  VirtualFrame* const found = at(frame, capture_stamp_ns);
  if (!found) return;
  std::erase_if(found->particles,
                [&](const ParticleCloud& other) { return other.source == particles.source; });
  found->particles.push_back(std::move(particles));
}

void VirtualFrames::add_state(std::uint64_t frame, std::int64_t capture_stamp_ns,
                              std::vector<ObjectPose> poses) {
  VirtualFrame* const found = at(frame, capture_stamp_ns);
  if (!found) return;
  found->poses = std::move(poses);
  found->complete = true;
  found->capture_stamp_ns = capture_stamp_ns;
}

bool VirtualFrames::has(std::uint64_t frame) const {
  const VirtualFrame* const found = frames_.find(frame);
  return found && found->complete;
}

std::size_t VirtualFrames::between(std::optional<std::int64_t> after_ns,
                                   std::int64_t before_ns) const {
  return std::size_t(std::count_if(frames_.begin(), frames_.end(), [&](const auto& entry) {
    const std::int64_t stamp_ns = entry.value.capture_stamp_ns;
    return entry.value.complete && stamp_ns < before_ns && (!after_ns || stamp_ns > *after_ns);
  }));
}

const VirtualFrame* VirtualFrames::best_for(std::uint64_t frame) const {
  const decltype(frames_)::Entry* before = nullptr;
  const decltype(frames_)::Entry* oldest = nullptr;
  for (const auto& entry : frames_) {
    if (!entry.value.complete) continue;
    if (entry.frame <= frame && (!before || entry.frame > before->frame)) before = &entry;
    if (!oldest || entry.frame < oldest->frame) oldest = &entry;
  }
  const auto* const best = before ? before : oldest;
  return best ? &best->value : nullptr;
}

}  // namespace fivepipe::render
