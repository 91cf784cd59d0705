// Queries and scenes for the tests of proximity.
#pragma once
#include "common/collision/proximity/proximity.h"
#include "tests/support/hull/queries.h"

namespace fivepipe::test {

// Rounding of distances of about a metre, and of slivers (proximity_shapes.h).
inline constexpr double kRounding_m = 1e-9;

inline std::vector<collision::Proximity> of_points(const hull::HullQuery& query,
                                                   const collision::ProximityOptions& options,
                                                   std::span<const Eigen::Vector3d> points) {
  std::vector<collision::Proximity> found(points.size());
  collision::HullProximity(query, options).of_points(points, found);
  return found;
}
inline std::vector<collision::Proximity> of_triangles(
    const hull::HullQuery& query, const collision::ProximityOptions& options,
    std::span<const collision::Triangle> triangles) {
  std::vector<collision::Proximity> found(triangles.size());
  collision::HullProximity(query, options).of_triangles(triangles, found);
  return found;
}

// Returns whether the bounds are as tight as requested.
inline bool is_tight(const collision::Proximity& p, const collision::ProximityOptions& options) {
  return p.min_m >= options.cap_m || p.max_m - p.min_m <= options.tolerance_m + kRounding_m;
}

inline geometry::Camera looking(const Eigen::Vector3d& eye_m, int width_px, int height_px,
                                double fov_rad) {
  return {geometry::pinhole_from_fov(width_px, height_px, fov_rad),
          geometry::look_at(eye_m, Eigen::Vector3d::Zero(),
                            std::abs(eye_m.normalized().z()) > 0.9 ? Eigen::Vector3d::UnitX()
                                                                   : Eigen::Vector3d::UnitZ())};
}

// Silhouettes of a palm with two fingers in one to four cameras.
inline std::vector<hull::Silhouette> hand(int cameras = 3) {
  const std::vector<hull::Capsule> object = {{{-0.08, 0, 0}, {0.01, 0.01, 0.02}, 0.03},
                                             {{0.02, 0.01, 0.02}, {0.09, 0.03, 0.02}, 0.008},
                                             {{0.02, -0.01, 0.02}, {0.09, -0.03, 0}, 0.007}};
  std::vector<geometry::Camera> rig;
  const Eigen::Vector3d eyes_m[] = {
      {1, 0.2, 0.7}, {-0.5, 0.9, 0.6}, {-0.4, -1, 0.5}, {0.1, 0.1, -1.2}};
  for (int i = 0; i < cameras; ++i) rig.push_back(looking(eyes_m[i], 240, 180, 0.4));
  return silhouettes_of(object, rig);
}

inline std::vector<Eigen::Vector3d> random_points(Random& random, int count, double radius_m) {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i) points.push_back(random_in_ball(random, radius_m));
  return points;
}

inline collision::Triangle random_triangle(Random& random, double center_m, double size_m) {
  const Eigen::Vector3d center = random_in_ball(random, center_m);
  return {center + random_in_ball(random, size_m), center + random_in_ball(random, size_m),
          center + random_in_ball(random, size_m)};
}

}  // namespace fivepipe::test
