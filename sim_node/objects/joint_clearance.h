// Whether the jointed objects of a scene can move.
#pragma once
#include "common/config/scene.h"

namespace fivepipe::sim {

// Throws ConfigError if a jointed object overlaps a fixed one at the start by more than
// kMinOverlap_m: contact would hold it there or push it open. The shapes are those of RigidBodies:
// of a jointed mesh the convex hull.
void check_joint_clearance(const config::Scene& scene);

// Objects of 0.1 to 10 m that touch have a smaller overlap by rounding, in any pose.
inline constexpr double kMinOverlap_m = 1e-4;

}  // namespace fivepipe::sim
