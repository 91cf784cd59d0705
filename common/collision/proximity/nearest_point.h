// The point of a mesh that is nearest to a given point, and the triangles near a box.
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
// Returns the point of the tree's triangles that is nearest to p (both in the tree's frame).
// Returns nullopt if it is more than reach_m from p, or if p is not finite.
std::optional<NearestPoint> nearest_point(const Bvh& tree, const Eigen::Vector3d& p_m,
                                          double reach_m);

// Calls `take` for each triangle whose bounding box in the tree may overlap the box (tree's frame),
// in unspecified order. Does not call it if the box is not finite.
void each_triangle_near(const Bvh& tree, const Eigen::AlignedBox3d& box_m,
                        const std::function<void(std::uint32_t triangle)>& take);

}  // namespace fivepipe::collision
