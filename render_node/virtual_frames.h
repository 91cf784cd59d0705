// Collects the simulation's results by frame: object poses, colliding objects, marks of the
// overlays and particles. Keeps at most kMaxFrames frames and drops the one that was added first.
#pragma once
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/pipeline/frames/recent_frames.h"
#include "common/pipeline/frames/restart_detector.h"
#include "render_node/overlays/collision_marks.h"
#include "render_node/renderer.h"

namespace fivepipe::render {

struct VirtualFrame {
  std::vector<ObjectPose> poses;
  std::set<std::string> colliding;
  std::vector<CollisionMarks> marks;     // at most one per object
  std::vector<ParticleCloud> particles;  // at most one per source
  // True if the state has arrived. sim_node sends collisions and particles before the state.
  bool complete = false;
  std::int64_t capture_stamp_ns = 0;
};

class VirtualFrames {
 public:
  static constexpr std::size_t kMaxFrames = 16;

  // Adds a colliding object, the marks of an object, the particles of a source or the poses of a
  // frame. Ignores a frame that was displaced. Drops all kept frames if the source has restarted.
  void add_collision(std::uint64_t frame, std::int64_t capture_stamp_ns, const std::string& object);
  void add_marks(std::uint64_t frame, std::int64_t capture_stamp_ns, CollisionMarks marks);
  void add_particles(std::uint64_t frame, std::int64_t capture_stamp_ns, ParticleCloud particles);
  void add_state(std::uint64_t frame, std::int64_t capture_stamp_ns, std::vector<ObjectPose> poses);

  // Returns true if the state of this frame has arrived.
  bool has(std::uint64_t frame) const;
  // Returns the number of kept states whose frames were captured after `after_ns`, if it is given,
  // and before `before_ns`.
  std::size_t between(std::optional<std::int64_t> after_ns, std::int64_t before_ns) const;
  // Returns the newest complete frame with a number <= `frame`, otherwise the oldest complete one.
  // Returns nullptr if no state has arrived. Valid until the next add.
  const VirtualFrame* best_for(std::uint64_t frame) const;

 private:
  VirtualFrame* at(std::uint64_t frame, std::int64_t capture_stamp_ns);
  frames::RestartDetector restart_detector_{frames::RestartBy::stamp};
  frames::RecentFrames<VirtualFrame> frames_{kMaxFrames};
};

}  // namespace fivepipe::render
