// The reference, against point membership and against silhouettes in closed form.
#include <gtest/gtest.h>

#include <cmath>

#include "common/hull/oracle/reference.h"
#include "tests/support/hull/scenes.h"

namespace fivepipe::hull {
namespace {

using namespace test;

TEST(Reference, IntervalsAgreeWithInHull) {
  int inside = 0;
  for (int seed = 1; seed <= 30; ++seed) {
    test::Random random(seed);
    const auto silhouettes = test::silhouettes_of(
        {test::random_cameras(random, 1 + seed % 4), test::random_object(random, 3)});
    const View view{test::random_camera(random, 40, 30, 0.8), 0.05, 4.0};
    for (int i = 0; i < 100; ++i) {
      const geometry::Ray ray = geometry::ray_through(
          view.camera, {test::uniform(random, 0, 39), test::uniform(random, 0, 29)});
      const auto intervals = reference_intervals(silhouettes, ray, view.near_m, view.far_m);
      for (int k = 0; k < 100; ++k) {
        const double t = test::uniform(random, view.near_m, view.far_m);
        const bool expected =
            std::any_of(intervals.begin(), intervals.end(),
                        [&](const Interval& x) { return t > x.enter && t < x.leave; });
        EXPECT_EQ(in_hull(silhouettes, ray.origin_world_m + t * ray.direction_world), expected);
        inside += expected;
      }
      for (std::size_t k = 0; k < intervals.size(); ++k) {
        EXPECT_LT(intervals[k].enter, intervals[k].leave);
        if (k > 0) {
          EXPECT_LT(intervals[k - 1].leave, intervals[k].enter);
        }
      }
    }
  }
  EXPECT_GT(inside, 1000);
}

// A ray across the pyramid of pixel (0, 0), half a pixel to each side at depth 1.
TEST(Reference, OnePixelHasItsClosedForm) {
  Silhouette s{{{11, 11, 10, 10, 5, 5}, Eigen::Isometry3d::Identity()}, ObjectPixels(11, 11)};
  s.pixels.set(5, 5);
  const auto intervals = reference_intervals(s, {{-3, 0, 1}, {1, 0, 0}}, 0.5, 10);
  ASSERT_EQ(intervals.size(), 1u);
  EXPECT_NEAR(intervals[0].enter, 2.95, 1e-12);
  EXPECT_NEAR(intervals[0].leave, 3.05, 1e-12);
}

TEST(Reference, NothingBehindTheCameraIsInTheHull) {
  Silhouette s{{{11, 11, 10, 10, 5, 5}, Eigen::Isometry3d::Identity()}, ObjectPixels(11, 11)};
  s.pixels.set(5, 5);
  EXPECT_TRUE(reference_intervals(s, {{-3, 0, -1}, {1, 0, 0}}, 0.5, 10).empty());
  const auto through_the_center = reference_intervals(s, {{0, 0, -2}, {0, 0, 1}}, 0.5, 10);
  ASSERT_EQ(through_the_center.size(), 1u);
  EXPECT_NEAR(through_the_center[0].enter, 2, 1e-12);
  EXPECT_EQ(through_the_center[0].leave, 10);
}

// As pixels become finer, the hull of the maps converges to that of the true silhouettes. The entry
// along a ray that does not graze differs from that of the true silhouettes by less than two pixel
// footprints, divided by the sine of the angle (here at least 0.2) between ray and silhouette cone.
TEST(Reference, FineMapsGiveTheAnalyticHull) {
  test::Random random(9);
  const std::vector<Capsule> ball{{{0, 0, 0}, {0, 0, 0}, 0.1}};
  std::vector<geometry::Camera> cameras;
  for (const double angle : {0.3, 1.5, 2.9})
    cameras.push_back(
        {geometry::pinhole_from_fov(1600, 1600, 0.3),
         geometry::look_at(1.5 * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.5),
                           {0, 0, 0})});
  const auto silhouettes = test::silhouettes_of(ball, cameras);
  const double footprint_m = 1.7 / cameras[0].pinhole.fx_px;
  const View view{
      {geometry::pinhole_from_fov(40, 40, 0.1), geometry::look_at({0.2, -1, 0.3}, {0, 0, 0})},
      0.05,
      4.0};  // sees only the ball's center
  for (int i = 0; i < 1600; i += 7) {
    const geometry::Ray ray = geometry::ray_through(view.camera, Eigen::Vector2d(i % 40, i / 40));
    const auto depth = reference_depth_m(silhouettes, view, i % 40, i / 40);
    ASSERT_TRUE(depth);
    const double margin = 2 * footprint_m / 0.2;
    EXPECT_TRUE(in_analytic_hull(ball, cameras,
                                 ray.origin_world_m + (*depth + margin) * ray.direction_world));
    EXPECT_FALSE(in_analytic_hull(ball, cameras,
                                  ray.origin_world_m + (*depth - 1e-9) * ray.direction_world));
  }
}

TEST(Reference, NoCameraHasNoHull) {
  for (const HullRule& rule : {HullRule{}, HullRule{Limits::seen, 1}, HullRule{Limits::seen, 0}})
    EXPECT_TRUE(
        reference_intervals(std::span<const Silhouette>(), {{0, 0, 1}, {1, 0, 0}}, 0, 1, rule)
            .empty());
}

// Two cameras at right angles see a cube of about 1 m. The ray starts in front of it.
TEST(Reference, DepthIsTheStartOfTheFirstIntervalByTheRule) {
  std::vector<Silhouette> silhouettes;
  for (const Eigen::Vector3d& eye : {Eigen::Vector3d(100, 0, 0), Eigen::Vector3d(0, 0, 100)}) {
    silhouettes.push_back({{{200, 200, 5000, 5000, 99.5, 99.5},
                            geometry::look_at(eye, {0, 0, 0}, Eigen::Vector3d(0, 1, 0))},
                           ObjectPixels(200, 200)});
    for (int v = 75; v < 125; ++v) silhouettes.back().pixels.set_run(75, 125, v);
  }
  const View view{
      {{11, 11, 10, 10, 5, 5}, geometry::look_at({0.01, -10, 0.01}, {0.01, 0, 0.01})}, 1, 30};
  const auto depth = reference_depth_m(silhouettes, view, 5, 5);
  ASSERT_TRUE(depth);
  EXPECT_NEAR(*depth, 9.5, 0.01);
  EXPECT_FALSE(reference_depth_m(silhouettes, view, 0, 5));
  View from_inside = view;
  from_inside.near_m = 10;
  EXPECT_EQ(reference_depth_m(silhouettes, from_inside, 5, 5), 10.0);
  View short_view = view;
  short_view.far_m = 9;
  EXPECT_FALSE(reference_depth_m(silhouettes, short_view, 5, 5));
  // With Limits::seen the second camera alone, if it does not see the object, removes it.
  EXPECT_EQ(reference_depth_m(silhouettes, view, 5, 5, {Limits::seen, 2}), depth);
  silhouettes.push_back(silhouettes[1]);
  silhouettes[2].camera.camera_from_world =
      geometry::look_at({0, 0, 100}, {0, 0, 200}, Eigen::Vector3d(0, 1, 0));  // looks away
  EXPECT_FALSE(reference_depth_m(silhouettes, view, 5, 5));
  EXPECT_EQ(reference_depth_m(silhouettes, view, 5, 5, {Limits::seen, 2}), depth);
  EXPECT_FALSE(reference_depth_m(silhouettes, view, 5, 5, {Limits::seen, 3}));
}

TEST(Reference, NotANumberHasNoHull) {
  Silhouette s{{{11, 11, 10, 10, 5, 5}, Eigen::Isometry3d::Identity()}, ObjectPixels(11, 11)};
  s.pixels.set(5, 5);
  EXPECT_TRUE(reference_intervals(s, {{NAN, 0, 1}, {1, 0, 0}}, 0.5, 10).empty());
  EXPECT_TRUE(reference_intervals(s, {{0, 0, 1}, {1, NAN, 0}}, 0.5, 10).empty());
  EXPECT_TRUE(reference_intervals(s, {{-3, 0, 1}, {1, 0, 0}}, 0.5, NAN).empty());
}

}  // namespace
}  // namespace fivepipe::hull
