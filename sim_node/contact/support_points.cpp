#include "sim_node/contact/support_points.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "common/collision/response/farthest_point_sample.h"

namespace fivepipe::sim {

std::vector<std::size_t> support_points(std::span<const Eigen::Vector3d> points_m,
                                        std::span<const double> height_m,
                                        const SupportSample& sample) {
  assert(!points_m.empty() && points_m.size() == height_m.size());
  const double lowest_m = *std::min_element(height_m.begin(), height_m.end());
  std::vector<std::size_t> first;  // those that touch first
  for (std::size_t i = 0; i < points_m.size(); ++i)
    if (height_m[i] <= lowest_m + sample.touches_first_m) first.push_back(i);
  assert(!first.empty());
  std::vector<Eigen::Vector3d> first_m;
  for (const std::size_t i : first) first_m.push_back(points_m[i]);
  std::vector<std::size_t> chosen;
  for (const std::size_t i :
       collision::farthest_point_sample(first_m, {collision::outermost_point(first_m)},
                                        sample.max_points, sample.min_distance_m))
    chosen.push_back(first[i]);
  return collision::farthest_point_sample(points_m, std::move(chosen), sample.max_points,
                                          sample.min_distance_m);
}

}  // namespace fivepipe::sim
