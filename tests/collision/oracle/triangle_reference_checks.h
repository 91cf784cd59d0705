// Helpers for the tests of the exact reference for triangles.
#pragma once
#include <algorithm>
#include <cmath>

#include "common/collision/oracle/triangle_reference.h"
#include "tests/support/collision/scene.h"

namespace fivepipe::test {

// Bound of the rounding error of a border's position on a triangle, in weights: about 1e-14 for
// cameras, hull and triangle within a few metres.
inline constexpr double kWeightMargin = 1e-11;

// The camera with a full map.
inline hull::Silhouette all_object(const geometry::Camera& camera) {
  hull::Silhouette s{camera, hull::ObjectPixels(camera.pinhole.width_px, camera.pinhole.height_px)};
  for (int v = 0; v < s.pixels.height_px(); ++v)
    for (int u = 0; u < s.pixels.width_px(); ++u) s.pixels.set(u, v);
  return s;
}

// A triangle with vertices at most extent_m from the origin.
inline collision::Triangle random_triangle_in_ball(Random& random, double extent_m) {
  return {random_in_ball(random, extent_m), random_in_ball(random, extent_m),
          random_in_ball(random, extent_m)};
}

// The fraction of the triangle that is in the hull.
inline double fraction(std::span<const hull::Silhouette> silhouettes,
                       const collision::Triangle& t) {
  return collision::triangle_truth(collision::HullDistance(silhouettes), t).fraction_in_hull;
}

// Counts the polygons that contain the weights at a distance of more than `margin` from their
// edges. A negative margin enlarges the polygons.
inline int containing_polygons(const std::vector<collision::WeightPolygon>& polygons,
                               const Eigen::Vector3d& w, double margin) {
  constexpr double kNoEdge = 1e-13;  // shorter edges separate two cuts that differ only by rounding
  return int(
      std::count_if(polygons.begin(), polygons.end(), [&](const collision::WeightPolygon& polygon) {
        bool any_edge = false;
        for (std::size_t i = 0; i < polygon.size(); ++i) {
          const Eigen::Vector2d a = polygon[i].tail<2>(),
                                edge = polygon[(i + 1) % polygon.size()].tail<2>() - a,
                                to = w.tail<2>() - a;
          if (!(edge.norm() > kNoEdge)) continue;
          if (!(edge.x() * to.y() - edge.y() * to.x() > margin * edge.norm())) return false;
          any_edge = true;
        }
        return any_edge;
      }));
}

// Expects each sample in one polygon if it is in_hull(), and in none otherwise. Returns the number
// of samples in the hull.
inline int check_samples(Random& random, std::span<const hull::Silhouette> silhouettes,
                         const collision::Triangle& triangle, int samples,
                         double margin = kWeightMargin) {
  const collision::Triangle t = collision::sorted(triangle);
  const auto polygons = collision::weights_in_hull(silhouettes, triangle);
  int inside = 0;
  for (int i = 0; i < samples; ++i) {
    const double a = std::sqrt(uniform(random, 0, 1)), b = uniform(random, 0, 1);
    const Eigen::Vector3d w(1 - a, a * (1 - b), a * b);
    const bool expected =
        hull::in_hull(silhouettes, t[0] + w.y() * (t[1] - t[0]) + w.z() * (t[2] - t[0]));
    EXPECT_LE(containing_polygons(polygons, w, margin), expected ? 1 : 0);
    if (expected) {
      EXPECT_GE(containing_polygons(polygons, w, -margin), 1);
    }
    inside += expected;
  }
  return inside;
}

}  // namespace fivepipe::test
