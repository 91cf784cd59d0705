// Parts of the hull followed over frames: who is who, and how it moves. Nothing is guessed: where
// two could be the same, none is.
//
// A part is the one of the frame before that it lies nearest to, if that lies nearest to it, too,
// and both by a factor of kMatchRatio; the part before is taken to have gone on as it moved. What
// met, or came apart, has new numbers, and says of whom: parts whose boxes meet, and that nothing
// else was before, or is now. Of a part that clearly went on it is said only where its volume
// tells, too: it grew, or shrank, by half of the other's at least, and the other is not below a
// tenth of its own. A smaller one it may take up, or lose, unsaid, and stays who it is.
//
// Velocity and rotation: the even motion that fits the part's outlines over the last frames best
// (outline_motion.h). Where a part comes without outlines, or too few cameras see it by itself: the
// line through its middles, which are the hull's, and no rotation.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "common/collision/tracking/hull_components.h"
#include "common/collision/tracking/outline_motion.h"

namespace fivepipe::collision {

enum class ComponentOrigin {
  appeared,  // there was nothing where it came from, or nothing that it clearly was
  tracked,   // the one of the frame before
  merged,    // of those in `from`
  split      // off the one in `from`
};

struct ComponentMotion {
  Eigen::Vector3d velocity_world_m_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_velocity_world_rad_s =
      Eigen::Vector3d::Zero();  // of what the shape determines
  int determined_axes = 0;      // 3: about all; 2: about those across its long, or short, axis; 0:
                                // about none, or none is known, as in braking
  double residual_m = 0;        // of the outlines' fit, root mean square; 0 without one
  double window_s = 0;          // that it is an average over
  int frames = 0;               // in the window
};

struct TrackedComponent {
  std::uint64_t id = 0;  // never given twice
  ComponentOrigin origin = ComponentOrigin::appeared;
  std::vector<std::uint64_t> from;  // numbers of the frame before
  HullComponent part;
  std::optional<ComponentMotion> motion;  // from the third frame on
};

struct ComponentTrackerOptions {
  int window_frames = 8;     // >= 3
  double max_speed_m_s = 6;  // nothing moves faster
  // After a longer one tracking starts anew: a camera of 10 Hz may lose a frame; in more time the
  // fastest gets across a room, and anyone is in reach.
  double max_gap_s = 0.25;
};

class ComponentTracker {
 public:
  explicit ComponentTracker(const ComponentTrackerOptions& options = {});
  // The parts of one more frame. A time that is not later than the last, or by more than
  // max_gap_s, starts anew. Throws std::invalid_argument where it is not finite.
  const std::vector<TrackedComponent>& add(double time_s, const std::vector<HullComponent>& parts);
  const std::vector<TrackedComponent>& parts() const { return parts_; }
  void reset();

 private:
  struct Track {
    std::deque<OutlineSnapshot> window;
    std::optional<UniformMotion> guess;  // of the frame before
  };
  Eigen::Vector3d predicted_center_m(std::size_t i, double time_s) const;
  std::vector<std::optional<std::size_t>> match(double time_s,
                                                const std::vector<HullComponent>& parts) const;
  std::optional<ComponentMotion> motion_of(Track& track, const HullComponent& part) const;

  ComponentTrackerOptions options_;
  std::uint64_t next_id_ = 1;
  double time_s_ = 0;
  std::vector<TrackedComponent> parts_;
  std::vector<Track> tracks_;  // as parts_
};

// How much nearer than the next best a match must be.
inline constexpr double kMatchRatio = 2;

}  // namespace fivepipe::collision
