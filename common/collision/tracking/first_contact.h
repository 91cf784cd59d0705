// First contact of a moving hull component with a virtual object between two frames, so that fast
// motion does not tunnel through thin shapes.
//
// Between the frames the component is assumed to move rigidly: its centroid along a straight line,
// with constant angular velocity. The moving hull is then equivalent to the hull at rest and an
// object with the inverse motion. The first half of the time uses the previous frame's hull, the
// second half the later frame's.
//
// The search tests the object at steps over which no point of the component moves more than step_m
// relative to the object, then bisects. Under the assumed motion it finds every contact with a
// component thicker than step_m along its motion. It cannot find a component that appears and
// vanishes between the frames. It counts collision points in the component's bounding box,
// including those of another component that reaches into the box.
#pragma once
#include <optional>

#include "common/collision/detection/cpu/cpu_detection.h"
#include "common/collision/tracking/hull_components.h"

namespace fivepipe::collision {

// The hull and one of its components in one frame. The query must outlive the snapshot.
struct HullSnapshot {
  const hull::HullQuery* query;
  double time_s;
  HullComponent component;
};

struct MovingObject {
  const Bvh* tree;
  Eigen::Isometry3d world_from_object_before, world_from_object_after;
};

struct FirstContactOptions {
  double step_m = 0.0015;  // about a pixel's footprint; >= kMinEps_m
  // The component's rotation from the previous frame to the later one.
  Eigen::Vector3d rotation_world_rad = Eigen::Vector3d::Zero();
  int max_steps = 512;  // > 0; a longer motion takes longer steps and sets FirstContact::coarse
};

struct FirstContact {
  double time_s;  // first time at which a contact was found
  // No contact was found at time_s - time_error_s. 0: component and object touch in the previous
  // frame.
  double time_error_s;
  Eigen::Vector3d p_world_m;  // a contact point at time_s
  std::uint32_t triangle;
  bool coarse;  // the steps were longer than step_m
};

// Returns nullopt if component and object do not touch in [before.time_s, after.time_s]. Throws
// std::invalid_argument if after.time_s <= before.time_s, a number is not finite, or an option is
// out of range.
std::optional<FirstContact> first_contact(const HullSnapshot& before, const HullSnapshot& after,
                                          const MovingObject& object,
                                          const FirstContactOptions& options = {});

}  // namespace fivepipe::collision
