// Conservative test of a box against the visual hull, in the images alone.
//
// With Limits::all the hull meets a box only if every camera has an object pixel in the box's
// projection. One camera without such a pixel certifies the box free. With Limits::seen, one camera
// without such a pixel certifies it if it sees all of the box; so do fewer than min_seen cameras
// with such a pixel. A box outside the rule's box is free. The converse does not hold, because the
// object pixels may belong to different points, so a box that is not certified is split into
// octants.
#pragma once
#include <Eigen/Geometry>
#include <span>

#include "common/hull/hull.h"

namespace fivepipe::collision {

// Returns true only if no point of the closed box [world, m] is in_hull(). Returns false if the
// box, split `depth` times into octants, has an octant that is not certified; depth 0 tests the box
// itself. Without cameras the hull is empty and the result is true.
bool is_certainly_free(std::span<const hull::Silhouette> silhouettes,
                       const Eigen::AlignedBox3d& box_world_m, int depth = 0,
                       const hull::HullRule& rule = {});

}  // namespace fivepipe::collision
