// Proximity of points on the border, far away, or not finite; invalid options.
#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

#include "common/hull/oracle/reference.h"
#include "tests/collision/proximity/proximity_queries.h"
#include "tests/support/not_finite.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

TEST(Proximity, IsZeroOnTheBorderAndInTheHull) {
  const std::vector<hull::Silhouette> silhouettes = hand();
  const Queries q(silhouettes);
  Random random(7);
  std::vector<Vector3d> on, in;
  for (int i = 0; i < 200; ++i) {
    const Vector3d from = 0.3 * random_direction(random);
    const geometry::Ray ray{from, random_in_ball(random, 0.02) - from};
    const auto pieces = hull::reference_intervals(silhouettes, ray, 0, 2);
    if (!pieces.empty()) on.push_back(from + pieces.front().enter * ray.direction_world);
    const Vector3d p = random_in_ball(random, 0.08);
    if (hull::in_hull(silhouettes, p)) in.push_back(p);
  }
  ASSERT_GT(on.size(), 100u);
  ASSERT_GT(in.size(), 30u);
  for (const collision::Proximity& p : of_points(q.query, {0.05, 0.001}, on)) {
    EXPECT_LE(p.min_m, 1e-12);
    EXPECT_LE(p.max_m, 0.001);
  }
  for (const collision::Proximity& p : of_points(q.query, {0.05, 0.001}, in))
    EXPECT_EQ(p, (collision::Proximity{0, 0}));
}

TEST(Proximity, NonFiniteInputHasUnknownDistance) {
  const collision::ProximityOptions options{0.05, 0.001};
  const std::vector<Vector3d> points = {{0, 0, 0.3}, {kNaN, 0, 0}, {0, kInfinity, 0}};
  const std::vector<collision::Triangle> triangles = {{points[0], points[0], points[0]},
                                                      {points[0], points[1], points[0]}};
  const collision::Proximity unknown{0, kInfinity}, none{kInfinity, kInfinity},
      beyond{0.05, kInfinity};
  const auto silhouettes = hand();
  EXPECT_EQ(of_points(Queries(silhouettes).query, options, points),
            (std::vector{beyond, unknown, unknown}));
  EXPECT_EQ(of_triangles(Queries(silhouettes).query, options, triangles),
            (std::vector{beyond, unknown}));
  auto emptied = silhouettes;
  emptied[1].pixels = hull::ObjectPixels(240, 180);
  EXPECT_EQ(of_points(Queries(emptied).query, options, points),
            (std::vector{none, unknown, unknown}));
  EXPECT_EQ(of_triangles(Queries(emptied).query, options, triangles), (std::vector{none, unknown}));
  EXPECT_EQ(of_points(Queries({}).query, options, points), (std::vector{none, unknown, unknown}));
  auto broken = silhouettes;
  broken[1].camera.pinhole.fx_px = kNaN;
  EXPECT_EQ(of_points(Queries(broken).query, options, points),
            (std::vector{unknown, unknown, unknown}));
}

TEST(Proximity, HoldsAtFarPointsAndCameraCenters) {
  const auto silhouettes = hand();
  const Queries q(silhouettes);
  std::vector<Vector3d> points = {
      {1e3, 0, 0}, {1e9, 1e9, 0}, {1e100, 0, 0}, {-1e300, 1e300, 1e300}};
  for (const hull::Silhouette& s : silhouettes) {
    points.push_back(geometry::camera_center_world_m(s.camera));
    points.push_back(point_in_world(s.camera, {0, 0, 1e-9}));
    points.push_back(point_in_world(s.camera, {0, 0, -1e-9}));
    points.push_back(point_in_world(s.camera, {0, 0, -0.5}));
  }
  for (const double cap_m : {1e-3, 0.05, 10.0}) {
    const auto found = of_points(q.query, {cap_m, cap_m / 100}, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_GE(found[i].min_m, 0);
      EXPECT_LE(found[i].min_m, std::min(cap_m, found[i].max_m));
      if (points[i].norm() > 1e99) continue;             // the distance may be unknown
      const double to_hand_m = points[i].norm() - 0.13;  // the hand is within 13 cm of the origin
      EXPECT_TRUE(is_tight(found[i], {cap_m, cap_m / 100}))
          << found[i].min_m << " to " << found[i].max_m << " at " << points[i].transpose();
      if (to_hand_m > 1.02 * cap_m) {
        EXPECT_EQ(found[i], (collision::Proximity{cap_m, kInfinity})) << points[i].transpose();
      }
    }
  }
}

TEST(Proximity, TerminatesBelowRoundingTolerance) {
  const Queries q(hand());
  Random random(12);
  for (const double tolerance_m : {1e-9, 1e-15, 1e-300})
    for (const collision::Proximity& p :
         of_points(q.query, {0.05, tolerance_m}, random_points(random, 20, 0.12)))
      EXPECT_LE(p.min_m, p.max_m);
}

TEST(Proximity, RejectsInvalidOptions) {
  const Queries q(hand());
  for (const collision::ProximityOptions& options : {collision::ProximityOptions{0, 0.001},
                                                     {-1, 0.001},
                                                     {kNaN, 0.001},
                                                     {kInfinity, 0.001},
                                                     {0.05, 0},
                                                     {0.05, -1},
                                                     {0.05, kNaN}})
    EXPECT_THROW(collision::HullProximity(q.query, options), std::invalid_argument);
}

}  // namespace
}  // namespace fivepipe::test
