// Tracks the hull's connected components from frame to frame: identity and motion.
//
// A component keeps its id if it and one predecessor are each other's nearest match: each nearer
// than the runner-up by kMatchRatio, volumes within a factor of 2, speed at most max_speed_m_s.
// Predecessors are predicted from their last velocity. An ambiguous component gets a new id.
//
// A merged or split component gets a new id and lists its predecessors in `from`. A matched
// component keeps its id unless its volume changed by at least half the volume of the other
// component involved, and that one has at least a tenth of its own volume. Components count as
// merged or split only if their bounding boxes meet after prediction.
//
// Velocity and rotation are those of the uniform motion that fits the component's outlines of the
// last frames best (outline_motion.h). Without outlines, or if too few cameras see the component
// separately, the velocity is the slope of a line through the hull's centroids, and the rotation is
// unknown.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "common/collision/tracking/hull_components.h"
#include "common/collision/tracking/outline_motion.h"

namespace fivepipe::collision {

enum class ComponentOrigin {
  appeared,  // no predecessor, or no unambiguous one
  tracked,   // continues its predecessor
  merged,    // from the components in `from`
  split      // from the component in `from`
};

struct ComponentMotion {
  Eigen::Vector3d velocity_world_m_s = Eigen::Vector3d::Zero();
  // About the axes that the shape determines; zero about the others.
  Eigen::Vector3d angular_velocity_world_rad_s = Eigen::Vector3d::Zero();
  // 3: all axes. 2: the two axes perpendicular to the shape's axis of symmetry. 0: none, or the
  // motion is too uneven to determine any.
  int determined_axes = 0;
  double residual_m = 0;  // RMS of the fit to the outlines; 0: no fit
  double window_s = 0;    // the motion is an average over this time
  int frames = 0;         // frames in the window
};

struct TrackedComponent {
  std::uint64_t id = 0;  // unique per tracker
  ComponentOrigin origin = ComponentOrigin::appeared;
  std::vector<std::uint64_t> from;  // ids in the previous frame
  HullComponent component = {};
  std::optional<ComponentMotion> motion = std::nullopt;  // present from the component's third frame
};

struct ComponentTrackerOptions {
  int window_frames = 8;     // >= 3
  double max_speed_m_s = 6;  // > 0; matching gate
  // A longer gap between frames resets the tracker. The default lets a camera of 10 Hz lose one
  // frame. After more time, the limit on speed excludes hardly any match.
  double max_gap_s = 0.25;
};

class ComponentTracker {
 public:
  // Throws std::invalid_argument if an option is out of range.
  explicit ComponentTracker(const ComponentTrackerOptions& options = {});
  // Adds the components of the next frame and returns them tracked, in the given order. Resets
  // first if time_s is not after the last frame's time or more than max_gap_s after it. Throws
  // std::invalid_argument if time_s is not finite.
  const std::vector<TrackedComponent>& add(double time_s,
                                           const std::vector<HullComponent>& components);
  // The components of the last add().
  const std::vector<TrackedComponent>& components() const { return components_; }
  void reset();  // forgets all frames; ids stay unique

 private:
  struct Track {
    std::deque<OutlineSnapshot> window;
    std::optional<UniformMotion> guess;  // the previous frame's motion: start of the fit
  };
  // `previous`: index in components_.
  Eigen::Vector3d predicted_center_m(std::size_t previous, double time_s) const;
  // Returns for each component the index of its unambiguous predecessor in components_.
  std::vector<std::optional<std::size_t>> match(double time_s,
                                                const std::vector<HullComponent>& components) const;
  std::optional<ComponentMotion> motion_of(Track& track, const HullComponent& component) const;

  ComponentTrackerOptions options_;
  std::uint64_t next_id_ = 1;
  double time_s_ = 0;
  std::vector<TrackedComponent> components_;
  std::vector<Track> tracks_;  // one per element of components_
};

// A match is unambiguous if the runner-up is farther by at least this factor.
inline constexpr double kMatchRatio = 2;

}  // namespace fivepipe::collision
