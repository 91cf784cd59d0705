// Tests if a camera sees any part of a box.
#pragma once
#include "common/geometry/camera.h"

namespace fivepipe::geometry {

// Returns true if some point of the box is in front of the camera and projects into its image,
// [-0.5, width - 0.5) x [-0.5, height - 0.5). Exact except for rounding: clips the box's faces
// against the camera's viewing pyramid (Sutherland and Hodgman 1974).
bool is_box_visible(const Camera& camera, const Eigen::AlignedBox3d& box_world_m);

}  // namespace fivepipe::geometry
