// Shading of the synthetic objects, and their shadow.
#pragma once
#include "capture_node/synthetic/actors/part.h"

namespace fivepipe::capture {

// Returns the colour of a surface point of `part` as seen from the eye, lamp fully visible: grey
// levels of 255, BGR, not clamped. Diffuse, ambient and specular light (Blinn 1977).
Eigen::Vector3f shaded(const SyntheticPart& part, const Eigen::Vector3d& p_world_m,
                       const Eigen::Vector3d& eye_world_m);

// Returns the fraction of the lamp (0 to 1) that a point sees past one capsule: the clearance of
// the line of sight divided by the width of the penumbra at the closest approach. The point must
// not be the lamp.
float lamp_visibility_past(const hull::Capsule& capsule, const Eigen::Vector3f& p_world_m);
// The same past a box: the fraction of 64 points of the lamp that the point sees.
float lamp_visibility_past(const geometry::OrientedBox& box, const Eigen::Vector3f& p_world_m);

}  // namespace fivepipe::capture
