#include "common/geometry/oriented_box.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fivepipe::geometry {
namespace {

// The cross product of two edges that are more nearly parallel than this is no axis: the faces'
// normals separate such boxes.
constexpr double kMinCross = 1e-9;

// Half of the box's extent along the axis.
double half_extent_m(const OrientedBox& box, const Eigen::Vector3d& axis) {
  return box.half_m.dot((box.world_from_box.linear().transpose() * axis).cwiseAbs());
}

}  // namespace

double overlap_m(const OrientedBox& a, const OrientedBox& b) {
  const Eigen::Vector3d between_m = b.world_from_box.translation() - a.world_from_box.translation();
  double smallest_m = std::numeric_limits<double>::infinity();
  const auto test = [&](const Eigen::Vector3d& axis) {
    const double length = axis.norm();
    if (!(length > kMinCross)) return;
    const Eigen::Vector3d unit = axis / length;
    smallest_m = std::min(smallest_m, half_extent_m(a, unit) + half_extent_m(b, unit) -
                                          std::abs(between_m.dot(unit)));
  };
  for (int i = 0; i < 3; ++i) {
    test(a.world_from_box.linear().col(i));
    test(b.world_from_box.linear().col(i));
    for (int k = 0; k < 3; ++k)
      test(a.world_from_box.linear().col(i).cross(b.world_from_box.linear().col(k)));
  }
  return std::max(0.0, smallest_m);
}

std::optional<double> ray_entry(const OrientedBox& box, const Ray& ray) {
  const Eigen::Isometry3d box_from_world = box.world_from_box.inverse();
  const Eigen::Vector3d origin_m = box_from_world * ray.origin_world_m,
                        direction = box_from_world.linear() * ray.direction_world;
  double near = 0, far = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0) {
      if (!(std::abs(origin_m[axis]) <= box.half_m[axis])) return std::nullopt;
      continue;
    }
    const double to_center = -origin_m[axis] / direction[axis],
                 half = box.half_m[axis] / std::abs(direction[axis]);
    if (!(to_center - half <= far && to_center + half >= near)) return std::nullopt;
    near = std::max(near, to_center - half);
    far = std::min(far, to_center + half);
  }
  return near;
}

}  // namespace fivepipe::geometry
