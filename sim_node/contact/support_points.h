// Selects the contact points on which an object stands.
//
// The solver takes at most kMaxHullContacts points per part of the hull. They must surround the
// object's centre and touch the hull at the same time. A farthest-point sample of all points of a
// contact (Gonzalez 1985) does neither: the outermost points of a block are on its sides and touch
// after its face, and a sample that begins in the middle of a face omits a corner.
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

namespace fivepipe::sim {

struct SupportSample {
  std::size_t max_points;
  // The points at most this much higher than the lowest one touch first [m].
  double touches_first_m;
  double min_distance_m;  // between two points
};

// Returns the indices of at most max_points points: a farthest-point sample of those that touch
// first, beginning with the outermost, continued among the others, which touch when the object
// turns. height_m: of each point, along the contact's normal, above any common plane. Distances
// that differ by less than collision::kEqual_m are equal: rounding does not choose. Requires at
// least one point and finite lengths.
std::vector<std::size_t> support_points(std::span<const Eigen::Vector3d> points_m,
                                        std::span<const double> height_m,
                                        const SupportSample& sample);

// SupportSample::touches_first_m in footprints of a pixel. The object turns by less than the maps
// resolve before a point touches that is this much higher.
inline constexpr double kTouchesFirst = 0.25;

}  // namespace fivepipe::sim
