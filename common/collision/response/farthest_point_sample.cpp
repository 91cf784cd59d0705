#include "common/collision/response/farthest_point_sample.h"

#include <algorithm>
#include <cassert>
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
                                               std::vector<std::size_t> chosen, std::size_t count,
                                               double min_m) {
  assert(!chosen.empty());
  if (chosen.size() >= count) return chosen;
  std::vector<double> distance2(points_m.size(), std::numeric_limits<double>::infinity());
  const auto include = [&](std::size_t i, std::size_t one) {
    distance2[i] = std::min(distance2[i], (points_m[i] - points_m[one]).squaredNorm());
  };
  // The loop below includes the last one.
  for (std::size_t c = 0; c + 1 < chosen.size(); ++c)
    for (std::size_t i = 0; i < points_m.size(); ++i) include(i, chosen[c]);
  while (chosen.size() < count) {
    std::size_t farthest = chosen.front();
    double farthest_m = 0, at_least2 = 0;  // a nearer point is neither farther nor equally far
    for (std::size_t i = 0; i < points_m.size(); ++i) {
      include(i, chosen.back());
      if (distance2[i] < at_least2) continue;
      const double more_m = std::sqrt(distance2[i]) - farthest_m;
      if (more_m > kEqual_m || (more_m >= -kEqual_m && less(points_m[i], points_m[farthest]))) {
        farthest = i;
        farthest_m += more_m;
        at_least2 = std::pow(std::max(0.0, farthest_m - 2 * kEqual_m), 2);
      }
    }
    if (!(farthest_m > min_m + kEqual_m)) break;
    chosen.push_back(farthest);
  }
  return chosen;
}

std::size_t outermost_point(std::span<const Eigen::Vector3d> points_m) {
  assert(!points_m.empty());
  Eigen::Vector3d sum_m = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p_m : points_m) sum_m += p_m;
  const Eigen::Vector3d centroid_m = sum_m / double(points_m.size());
  std::size_t outermost = 0;
  double outermost_m = 0;
  for (std::size_t i = 0; i < points_m.size(); ++i) {
    const double more_m = (points_m[i] - centroid_m).norm() - outermost_m;
    if (more_m > kEqual_m || (more_m >= -kEqual_m && less(points_m[i], points_m[outermost]))) {
      outermost = i;
      outermost_m += more_m;
    }
  }
  return outermost;
}

}  // namespace fivepipe::collision
