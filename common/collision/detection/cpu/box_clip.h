// Clips triangles to the box of a hull rule (HullRule::within_world_m).
#pragma once
#include <vector>

#include "common/collision/detection/triangle.h"

namespace fivepipe::collision {

// Returns the part of a triangle in the box: at least three vertices in the box, which may be
// equal, or none. Each is off the exact one by a few roundings of its coordinates.
std::vector<Eigen::Vector3d> clipped_to_box(const Triangle& triangle,
                                            const Eigen::AlignedBox3d& box_world_m);

// Returns a slightly smaller box: points of triangles in it are computed in the box in spite of
// rounding.
Eigen::AlignedBox3d inner_box(Eigen::AlignedBox3d box_world_m);

}  // namespace fivepipe::collision
