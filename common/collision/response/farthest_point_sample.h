// Farthest-point sampling: a few points that represent the extent of many.
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

namespace fivepipe::collision {

// Lengths and coordinates that differ by less count as equal. Many are equal in exact arithmetic,
// such as those of cells of a flat face; rounding must not choose among them, because what follows
// depends on the choice. Far below the maps' resolution, far above rounding.
inline constexpr double kEqual_m = 1e-9;

// Returns the indices of at most `count` points: `chosen`, then repeatedly the point farthest from
// all chosen points (Gonzalez, "Clustering to minimize the maximum intercluster distance", 1985).
// Stops when no point is farther than min_m from the chosen ones, by more than kEqual_m. Of equally
// far points it takes the lexicographically smallest (x, y, z), so the order of the input does not
// matter. Requires at least one chosen point.
std::vector<std::size_t> farthest_point_sample(std::span<const Eigen::Vector3d> points_m,
                                               std::vector<std::size_t> chosen, std::size_t count,
                                               double min_m);

// Returns the index of the point that is farthest from the centroid of all. Of equally far points
// it takes the lexicographically smallest. Requires at least one point.
std::size_t outermost_point(std::span<const Eigen::Vector3d> points_m);

}  // namespace fivepipe::collision
