// A box against the visual hull, conservatively, in the images: is the box certainly free of the
// hull? The hull meets the box only if each camera has an object pixel in the box's projection. One
// camera without certifies the box free. The converse does not hold (the pixels may belong to
// different points), so an undecided box is split and its eighths are asked.
#pragma once
#include <Eigen/Geometry>
#include <span>

#include "common/hull/hull.h"

namespace fivepipe::collision {

// True: no point of the closed box [m] is in_hull(). False: undecided after splitting `depth` times
// into eighths (depth 0: the box itself alone is asked). No cameras: free, the hull is empty.
bool is_certainly_free(std::span<const hull::Silhouette> silhouettes,
                       const Eigen::AlignedBox3d& box_world_m, int depth = 0);

}  // namespace fivepipe::collision
