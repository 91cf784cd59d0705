// Triangles and hulls for the tests of the detection's backends.
#pragma once
#include <algorithm>
#include <cmath>

#include "common/collision/detection/bvh.h"
#include "common/hull/query/hull_query.h"
#include "tests/support/collision_scene.h"

namespace fivepipe::test {

// A hull with its query; owns the silhouettes that both refer to.
struct CollisionHull {
  std::vector<hull::Silhouette> silhouettes;
  base::WorkerPool pool;
  hull::CpuHull hull;
  hull::HullQuery query;

  explicit CollisionHull(std::vector<hull::Silhouette> s, int threads = 1)
      : silhouettes(std::move(s)), pool(threads), hull(pool, silhouettes), query(hull) {}
};

inline geometry::Mesh mesh_of(const std::vector<collision::Triangle>& triangles) {
  geometry::Mesh mesh;
  for (const collision::Triangle& t : triangles) {
    const auto first = std::uint32_t(mesh.vertices_m.size());
    mesh.vertices_m.insert(mesh.vertices_m.end(), t.begin(), t.end());
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  return mesh;
}

inline std::vector<hull::Silhouette> hand_like() {
  std::vector<hull::Capsule> object{{{-0.1, 0, 0}, {0, 0, 0.01}, 0.03}};
  for (const double y : {-0.03, 0.0, 0.03})
    object.push_back({{0, y, 0}, {0.08, 1.5 * y, 0.01}, 0.009});
  return silhouettes_of(object, ring(4, 1.2, 0.6, 300, 0.5));
}

inline collision::Triangle random_triangle(Random& random, double place_m, double size_m) {
  const Eigen::Vector3d p = random_in_ball(random, place_m);
  return {p + random_in_ball(random, size_m), p + random_in_ball(random, size_m),
          p + random_in_ball(random, size_m)};
}

// A sample of the triangle in the hull, of n (n + 1) / 2.
inline bool sampled(std::span<const hull::Silhouette> silhouettes, const collision::Triangle& t,
                    int n) {
  for (int i = 0; i < n; ++i)
    for (int j = 0; i + j < n; ++j)
      if (hull::in_hull(silhouettes, t[0] + double(i) / (n - 1) * (t[1] - t[0]) +
                                         double(j) / (n - 1) * (t[2] - t[0])))
        return true;
  return false;
}

inline bool holds(const std::vector<std::uint32_t>& numbers, std::size_t n) {
  return std::binary_search(numbers.begin(), numbers.end(), std::uint32_t(n));
}

inline std::vector<collision::Triangle> random_triangles(Random& random, int count) {
  std::vector<collision::Triangle> triangles;
  for (int i = 0; i < count; ++i)
    triangles.push_back(
        random_triangle(random, 0.12, std::exp(uniform(random, std::log(0.002), std::log(0.3)))));
  return triangles;
}

}  // namespace fivepipe::test
