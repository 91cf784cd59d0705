// When and where a moving part of the hull first met a virtual object between two frames, so that
// what is fast does not pass through what is thin.
//
// Between the frames the part is taken to move rigidly: its middle along a straight line, turning
// evenly. Then the object against the moving hull is the object, moved the other way, against the
// hull at rest: that of the frame before in the first half of the time, that of the frame after in
// the second. It is asked at steps over which nothing of the part moves farther than step_m against
// the object, and then in between them (bisection). Any part that is thicker along its way than
// step_m is therefore found, as far as it moved as was taken; what a part did that came and went
// between the frames nobody knows. Collision points count that lie in the part's box: where another
// part reaches into it, those of that one, too.
#pragma once
#include <optional>

#include "common/collision/detection/cpu/cpu_detection.h"
#include "common/collision/tracking/hull_components.h"

namespace fivepipe::collision {

struct HullSnapshot {  // one frame
  const hull::HullQuery* query;
  double time_s;
  HullComponent part;
};

struct MovingObject {
  const Bvh* tree;
  Eigen::Isometry3d world_from_object_before, world_from_object_after;
};

struct FirstContactOptions {
  double step_m = 0.0015;  // about a pixel's footprint
  Eigen::Vector3d rotation_world_rad =
      Eigen::Vector3d::Zero();  // of the part, from the frame before to the one after
  int max_steps = 512;          // beyond, steps are longer, and the result says so
};

struct FirstContact {
  double time_s;        // at which they were first found to touch
  double time_error_s;  // so long before it they did not; 0 where they touch in the frame before
                        // already
  Eigen::Vector3d p_world_m;  // there and then
  std::uint32_t triangle;
  bool coarse;  // steps were longer than asked for
};

// Nothing where they don't meet in [before.time_s, after.time_s]. Throws std::invalid_argument
// where the times do not follow each other, a number is not finite, or the step is not positive.
std::optional<FirstContact> first_contact(const HullSnapshot& before, const HullSnapshot& after,
                                          const MovingObject& object,
                                          const FirstContactOptions& options = {});

}  // namespace fivepipe::collision
