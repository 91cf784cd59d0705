// The point of a mesh that is nearest to a given point.
#pragma once
#include <Eigen/Geometry>
#include <functional>
#include <optional>

#include "common/collision/detection/bvh.h"

namespace fivepipe::collision {

struct NearestPoint {
  std::uint32_t triangle;  // index in the mesh; among equally near ones, any
  Eigen::Vector3d p_m;     // tree's frame
  double distance_m;
};
// Returns the nearest point of the tree's triangles if it is at most reach_m from p (both in the
// tree's frame), or nullopt; also if p is not finite.
std::optional<NearestPoint> nearest_point(const Bvh& tree, const Eigen::Vector3d& p_m,
                                          double reach_m);

// Calls `take` for each triangle whose bounding box in the tree may meet the box (tree's frame), in
// no order. Takes none if the box is not finite.
void each_triangle_near(const Bvh& tree, const Eigen::AlignedBox3d& box_m,
                        const std::function<void(std::uint32_t triangle)>& take);

}  // namespace fivepipe::collision
