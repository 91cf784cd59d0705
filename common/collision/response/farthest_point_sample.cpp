#include "common/collision/response/farthest_point_sample.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fivepipe::collision {
namespace {

bool less(const Eigen::Vector3d& a_m, const Eigen::Vector3d& b_m) {
  for (int axis = 0; axis < 3; ++axis)
    if (std::abs(a_m[axis] - b_m[axis]) > kEqual_m) return a_m[axis] < b_m[axis];
  return false;
}

}  // namespace

std::vector<std::size_t> farthest_point_sample(std::span<const Eigen::Vector3d> points_m,
                                               std::size_t first, std::size_t count, double min_m) {
  std::vector<double> distance2(points_m.size(), std::numeric_limits<double>::infinity());
  distance2[first] = 0;
  std::vector<std::size_t> taken{first};
  while (taken.size() < count) {
    std::size_t farthest = first;
    double farthest_m = 0, at_least2 = 0;  // a nearer point is neither farther nor equally far
    for (std::size_t i = 0; i < points_m.size(); ++i) {
      distance2[i] = std::min(distance2[i], (points_m[i] - points_m[taken.back()]).squaredNorm());
      if (distance2[i] < at_least2) continue;
      const double more_m = std::sqrt(distance2[i]) - farthest_m;
      if (more_m > kEqual_m || (more_m >= -kEqual_m && less(points_m[i], points_m[farthest]))) {
        farthest = i;
        farthest_m += more_m;
        at_least2 = std::pow(std::max(0.0, farthest_m - 2 * kEqual_m), 2);
      }
    }
    if (!(distance2[farthest] > min_m * min_m)) break;
    taken.push_back(farthest);
  }
  return taken;
}

}  // namespace fivepipe::collision
