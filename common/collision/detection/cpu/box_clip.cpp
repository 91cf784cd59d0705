#include "common/collision/detection/cpu/box_clip.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fivepipe::collision {

using Eigen::Vector3d;

// The method is that of Sutherland and Hodgman (1974).
std::vector<Vector3d> clipped_to_box(const Triangle& triangle, const Eigen::AlignedBox3d& box) {
  std::vector<Vector3d> polygon(triangle.begin(), triangle.end()), kept;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {1.0, -1.0}) {
      const double face = side > 0 ? box.min()[axis] : box.max()[axis];
      if (!std::isfinite(face)) continue;
      kept.clear();
      for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Vector3d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
        const double at_a = side * (a[axis] - face), at_b = side * (b[axis] - face);
        if (at_a >= 0) kept.push_back(a);
        if ((at_a >= 0) == (at_b >= 0)) continue;
        kept.push_back(a + at_a / (at_a - at_b) * (b - a));
        kept.back()[axis] = face;
      }
      std::swap(polygon, kept);
    }
  for (Vector3d& v : polygon) v = v.cwiseMax(box.min()).cwiseMin(box.max());
  while (!polygon.empty() && polygon.size() < 3) polygon.push_back(polygon.back());
  return polygon;
}

Eigen::AlignedBox3d inner_box(Eigen::AlignedBox3d box) {
  constexpr double kRounding = 16 * std::numeric_limits<double>::epsilon();
  for (int axis = 0; axis < 3; ++axis) {
    double scale_m = 0;
    for (const double face : {box.min()[axis], box.max()[axis]})
      if (std::isfinite(face)) scale_m = std::max(scale_m, std::abs(face));
    box.min()[axis] += kRounding * scale_m;
    box.max()[axis] -= kRounding * scale_m;
  }
  return box;
}

}  // namespace fivepipe::collision
