#include "common/geometry/oriented_box.h"

#include <algorithm>
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

}  // namespace fivepipe::geometry
