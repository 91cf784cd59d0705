// Boxes in any orientation.
#pragma once
#include <Eigen/Geometry>
#include <optional>

#include "common/geometry/camera.h"

namespace fivepipe::geometry {

struct OrientedBox {
  Eigen::Isometry3d world_from_box;
  Eigen::Vector3d half_m;  // half of the edges; the box's centre is its origin
};

// Returns the length of the shortest translation that separates the boxes [m]; 0 if they do not
// overlap, infinity if one is not finite. Separating axes: Gottschalk, Lin and Manocha, "OBBTree",
// 1996.
double overlap_m(const OrientedBox& a, const OrientedBox& b);

// Returns the ray parameter (in units of the direction's length) at which the ray enters the box, 0
// if its origin is inside, or nullopt if the ray misses or the box is behind the origin.
std::optional<double> ray_entry(const OrientedBox& box, const Ray& ray);

}  // namespace fivepipe::geometry
