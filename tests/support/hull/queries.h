// Helpers of the tests of HullQuery.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/hull/query/hull_query.h"
#include "tests/support/hull/scenes.h"
#include "tests/support/hull/test_pool.h"

namespace fivepipe::test {

// A hull and its HullQuery.
struct Queries {
  hull::CpuHull hull;
  hull::HullQuery query;
  Queries(std::span<const hull::Silhouette> silhouettes, const hull::HullRule& rule = {})
      : hull(test_pool(), silhouettes, rule), query(hull) {}
};

inline const hull::HullRule kRules[] = {
    {}, {hull::Limits::seen, 1}, {hull::Limits::seen, 2}, {hull::Limits::seen, 3}};

inline Eigen::Vector3d point_in_world(const geometry::Camera& camera,
                                      const Eigen::Vector3d& p_camera_m) {
  return camera.camera_from_world.inverse() * p_camera_m;
}

// A point near the object, at the distance of the rays, or anywhere.
inline Eigen::Vector3d random_point(Random& random, int i) {
  return random_in_ball(random, i % 3 == 0 ? 0.2 : i % 3 == 1 ? 0.6 : 3.0);
}

// Expects that all sampled points of the ball are in the hull (solid), or that none is.
inline void expect_ball_kept(std::span<const hull::Silhouette> silhouettes,
                             const hull::HullRule& rule, const Eigen::Vector3d& p, double radius_m,
                             bool solid, Random& random, int samples) {
  ASSERT_GE(radius_m, 0);
  for (int i = 0; i < samples && radius_m > 0; ++i) {
    const double r =
        std::min(radius_m, 100.0) * (i % 2 ? 1 - 1e-12 : std::cbrt(uniform(random, 0, 1)));
    ASSERT_EQ(hull::in_hull(silhouettes, p + r * random_direction(random), rule), solid)
        << "radius " << radius_m << " m at " << p.transpose();
  }
}

}  // namespace fivepipe::test
