// Triangles, hulls and options for the tests of collision detection.
#pragma once
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/collision/detection/bvh.h"
#include "common/hull/query/hull_query.h"
#include "tests/support/collision/scene.h"

namespace fivepipe::test {

inline constexpr collision::DetectionOptions kVerdictOnly{.eps_m = 0.5e-3, .spacing_m = 0};
inline constexpr collision::DetectionOptions kAllPoints{
    .eps_m = 0.5e-3, .spacing_m = 3e-3, .max_points = 1u << 20};

// A hull with its query; owns the silhouettes that both refer to.
struct CollisionHull {
  std::vector<hull::Silhouette> silhouettes;
  base::WorkerPool pool;
  hull::CpuHull hull;
  hull::HullQuery query;

  explicit CollisionHull(std::vector<hull::Silhouette> s, int threads = 1,
                         const hull::HullRule& rule = {})
      : silhouettes(std::move(s)), pool(threads), hull(pool, silhouettes, rule), query(hull) {}
};

// The triangles as a mesh without shared vertices.
inline geometry::Mesh mesh_of(const std::vector<collision::Triangle>& triangles) {
  geometry::Mesh mesh;
  for (const collision::Triangle& t : triangles) {
    const auto first = std::uint32_t(mesh.vertices_m.size());
    mesh.vertices_m.insert(mesh.vertices_m.end(), t.begin(), t.end());
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  return mesh;
}

// A forearm with three fingers near the origin, seen by four cameras of 300 x 300 px.
inline std::vector<hull::Silhouette> hand_like() {
  std::vector<hull::Capsule> object{{{-0.1, 0, 0}, {0, 0, 0.01}, 0.03}};
  for (const double y : {-0.03, 0.0, 0.03})
    object.push_back({{0, y, 0}, {0.08, 1.5 * y, 0.01}, 0.009});
  return silhouettes_of(object, ring(4, 1.2, 0.6, 300, 0.5));
}

// The pose that puts a sheet of 2 m x 2 m (geometry::curtain_mesh()) horizontally through the hand.
inline Eigen::Isometry3d sheet_through_the_hand() {
  Eigen::Isometry3d world_from_sheet = at({0, 1, 0.002});
  world_from_sheet.linear() =
      Eigen::AngleAxisd(-std::numbers::pi / 2, Eigen::Vector3d::UnitX()).toRotationMatrix();
  return world_from_sheet;
}

// Vertices at most size_m from a point that is at most place_m from the origin.
inline collision::Triangle random_triangle(Random& random, double place_m, double size_m) {
  const Eigen::Vector3d p = random_in_ball(random, place_m);
  return {p + random_in_ball(random, size_m), p + random_in_ball(random, size_m),
          p + random_in_ball(random, size_m)};
}

// Returns whether one of n (n + 1) / 2 samples of the triangle is in the hull.
inline bool sampled(std::span<const hull::Silhouette> silhouettes, const collision::Triangle& t,
                    int n, const hull::HullRule& rule = {}) {
  for (int i = 0; i < n; ++i)
    for (int j = 0; i + j < n; ++j)
      if (hull::in_hull(
              silhouettes,
              t[0] + double(i) / (n - 1) * (t[1] - t[0]) + double(j) / (n - 1) * (t[2] - t[0]),
              rule))
        return true;
  return false;
}

// Lower bound of the radius [m] of the largest disc in a convex polygon.
inline double inner_radius_m(const std::vector<Eigen::Vector3d>& polygon) {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : polygon) center += p / double(polygon.size());
  double radius_m = polygon.size() < 3 ? 0 : 1e9;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector3d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    if ((b - a).norm() < 1e-12) continue;
    radius_m = std::min(radius_m, (b - a).cross(center - a).norm() / (b - a).norm());
  }
  return radius_m;
}

// Returns whether the ascending numbers contain n.
inline bool holds(const std::vector<std::uint32_t>& numbers, std::size_t n) {
  return std::binary_search(numbers.begin(), numbers.end(), std::uint32_t(n));
}

// Triangles near the origin with sizes from 2 mm to 30 cm.
inline std::vector<collision::Triangle> random_triangles(Random& random, int count) {
  std::vector<collision::Triangle> triangles;
  for (int i = 0; i < count; ++i)
    triangles.push_back(
        random_triangle(random, 0.12, std::exp(uniform(random, std::log(0.002), std::log(0.3)))));
  return triangles;
}

// Returns whether a collision point is within distance_m of p_world_m.
inline bool has_point_near(const collision::ObjectCollision& collision,
                           const Eigen::Vector3d& p_world_m, double distance_m) {
  return std::any_of(collision.points.begin(), collision.points.end(),
                     [&](const collision::CollisionPoint& q) {
                       return (q.p_world_m - p_world_m).norm() <= distance_m;
                     });
}

}  // namespace fivepipe::test
