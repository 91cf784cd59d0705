#include "common/collision/response/farthest_point_sample.h"

#include <algorithm>
#include <limits>

namespace fivepipe::collision {
namespace {

bool less(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

}  // namespace

std::vector<std::size_t> farthest_point_sample(std::span<const Eigen::Vector3d> points_m,
                                               std::size_t first, std::size_t count, double min_m) {
  std::vector<double> distance2(points_m.size(), std::numeric_limits<double>::infinity());
  distance2[first] = 0;
  std::vector<std::size_t> taken{first};
  while (taken.size() < count) {
    std::size_t farthest = first;
    for (std::size_t i = 0; i < points_m.size(); ++i) {
      distance2[i] = std::min(distance2[i], (points_m[i] - points_m[taken.back()]).squaredNorm());
      if (distance2[i] > distance2[farthest] ||
          (distance2[i] == distance2[farthest] && less(points_m[i], points_m[farthest])))
        farthest = i;
    }
    if (!(distance2[farthest] > min_m * min_m)) break;
    taken.push_back(farthest);
  }
  return taken;
}

}  // namespace fivepipe::collision
