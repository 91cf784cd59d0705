// A few of many points that stand for their extent.
#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

namespace fivepipe::collision {

// Indices of at most `count` points: `first`, then again and again the one farthest from all taken
// (Gonzalez, 1985), until none is farther than min_m from them. Equals: the least x, y, z, so
// that the same points are taken in whatever order they are given.
std::vector<std::size_t> farthest_point_sample(std::span<const Eigen::Vector3d> points_m,
                                               std::size_t first, std::size_t count, double min_m);

}  // namespace fivepipe::collision
