// HullQuery for segments and rays, against the reference and against points, and its hard cases.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/hull/oracle/reference.h"
#include "tests/support/hull/queries.h"
#include "tests/support/not_finite.h"

namespace fivepipe::hull {
namespace {

using namespace test;
using Eigen::Vector3d;

// Pieces of a ray shorter than this result from rounding at pixel borders [ray parameter].
constexpr double kTie = 1e-9;
// Bound of the difference between an end of an interval and the reference, for rays whose image
// does not move along a border [ray parameter].
constexpr double kAgree = 1e-8;

// Compares the intervals without pieces shorter than the tie.
std::vector<Interval> without_ties(std::vector<Interval> pieces, double tie) {
  std::vector<Interval> joined;
  for (const Interval& i : pieces)
    if (!joined.empty() && i.enter - joined.back().leave <= tie)
      joined.back().leave = i.leave;
    else
      joined.push_back(i);
  std::erase_if(joined, [tie](const Interval& i) { return i.leave - i.enter <= tie; });
  return joined;
}

void expect_reference(std::span<const Silhouette> silhouettes, const HullQuery& query,
                      const geometry::Ray& ray, double near, double far, double scale = 1) {
  const HullRule& rule = query.hull().rule();
  const auto found = query.intervals(ray, near, far);
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_LT(found[i].enter, found[i].leave);
    if (i > 0) {
      EXPECT_LT(found[i - 1].leave, found[i].enter);
    }
  }
  EXPECT_EQ(query.first_entry(ray, near, far),
            found.empty() ? std::nullopt : std::optional(found.front().enter));
  const auto mine = without_ties(found, kTie * scale),
             expected =
                 without_ties(reference_intervals(silhouettes, ray, near, far, rule), kTie * scale);
  ASSERT_EQ(mine.size(), expected.size());
  for (std::size_t i = 0; i < mine.size(); ++i) {
    EXPECT_NEAR(mine[i].enter, expected[i].enter, kAgree * scale);
    EXPECT_NEAR(mine[i].leave, expected[i].leave, kAgree * scale);
  }
}

// Returns the segment from a random point in a ball around the origin to one in another such ball.
geometry::Ray random_segment(test::Random& random, double from_radius_m, double to_radius_m) {
  const Vector3d from = test::random_in_ball(random, from_radius_m);
  return segment(from, test::random_in_ball(random, to_radius_m));
}

// Rays of any direction and length, with origins behind cameras and inside the hull.
TEST(HullQueryRay, EqualsTheReferenceOnRandomRigs) {
  for (int seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(seed);
    test::Random random(seed);
    const auto silhouettes = test::silhouettes_of(
        {test::random_cameras(random, 1 + seed % 6, 96, 67), test::random_object(random, 3)});
    for (const HullRule& rule : test::kRules) {
      const test::Queries q(silhouettes, rule);
      for (int i = 0; i < 25; ++i) {
        const double length = std::pow(10.0, test::uniform(random, -3, 3));
        const Vector3d from = test::random_point(random, i), to = test::random_in_ball(random, 0.3);
        expect_reference(silhouettes, q.query, {from, length * (to - from).normalized()},
                         i % 2 ? 0 : -1 / length, 4 / length, 1 / length);
        expect_reference(silhouettes, q.query, segment(from, to), 0, 1);
      }
    }
  }
}

TEST(HullQueryRay, EqualsTheReferenceOnNoise) {
  for (int seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    test::Random random(seed);
    std::vector<Silhouette> silhouettes;
    for (const geometry::Camera& camera : test::random_cameras(random, 3, 90, 67))
      silhouettes.push_back(
          {camera, test::random_pixels(random, 90, 67, std::vector{0.05, 0.4, 0.9}[seed % 3])});
    for (const HullRule& rule : test::kRules) {
      const test::Queries q(silhouettes, rule);
      for (int i = 0; i < 40; ++i)
        expect_reference(silhouettes, q.query, random_segment(random, 2, 0.3), 0, 2);
    }
  }
}

TEST(HullQueryRay, AgreesWithPoints) {
  int inside = 0;
  for (int seed = 1; seed <= 20; ++seed) {
    test::Random random(seed);
    const auto silhouettes = test::silhouettes_of(
        {test::random_cameras(random, 1 + seed % 5), test::random_object(random, 3)});
    for (const HullRule& rule : test::kRules) {
      const test::Queries q(silhouettes, rule);
      for (int i = 0; i < 20; ++i) {
        const geometry::Ray ray = random_segment(random, 2, 0.2);
        const auto found = q.query.intervals(ray, 0, 1.5);
        for (int k = 0; k < 60; ++k) {
          const double t = test::uniform(random, 0, 1.5);
          const bool expected = std::any_of(found.begin(), found.end(), [&](const Interval& x) {
            return x.enter <= t && t < x.leave;
          });
          EXPECT_EQ(q.query.contains(ray.origin_world_m + t * ray.direction_world), expected);
          inside += expected;
        }
      }
    }
  }
  EXPECT_GT(inside, 500);
}

// Two cameras at right angles, 2 m from the origin.
struct SquareQuery : ::testing::Test {
  std::vector<Silhouette> silhouettes;
  SquareQuery() {
    for (const Vector3d& eye : {Vector3d(2, 0, 0), Vector3d(0, 2, 0)})
      silhouettes.push_back(
          {{geometry::pinhole_from_fov(100, 75, 0.5), geometry::look_at(eye, {0, 0, 0})},
           ObjectPixels(100, 75)});
  }
  void fill(int camera, const PixelRect& r) {
    for (int v = r.v0_px; v < r.v1_px; ++v)
      for (int u = r.u0_px; u < r.u1_px; ++u) silhouettes[std::size_t(camera)].pixels.set(u, v);
  }
};

TEST_F(SquareQuery, RayThroughACameraCentreEqualsTheReference) {
  fill(0, {10, 10, 90, 70});
  fill(1, {10, 10, 90, 70});
  for (const HullRule& rule : test::kRules) {
    const test::Queries q(silhouettes, rule);
    for (const Vector3d& direction : {Vector3d(-1, 0.001, 0.002), Vector3d(-1, 0.1, 0.3),
                                      Vector3d(1, 0.1, 0.3), Vector3d(0.3, 1, 0.1)})
      expect_reference(silhouettes, q.query, {Vector3d(2, 0, 0) - direction, direction}, 0, 5);
  }
}

// The ray is in the plane of a row's upper border, so the query counts it as on one side without a
// gap.
TEST_F(SquareQuery, RayTangentToASilhouetteHasNoGap) {
  fill(0, {20, 20, 80, 60});
  fill(1, {20, 20, 80, 60});
  const geometry::Camera& c = silhouettes[0].camera;
  const test::Queries q(silhouettes);
  const auto on = [&](double u_px, double v_px, double z_m) {
    return test::point_in_world(c, {(u_px - c.pinhole.cx_px) / c.pinhole.fx_px * z_m,
                                    (v_px - c.pinhole.cy_px) / c.pinhole.fy_px * z_m, z_m});
  };
  for (const double off_px : {-1e-6, 0.0, 1e-6}) {
    const auto found =
        q.query.intervals(segment(on(10, 19.5 + off_px, 1.9), on(90, 19.5 + off_px, 2.05)), 0, 1);
    EXPECT_LE(found.size(), 1u);
    if (off_px < 0) {
      EXPECT_TRUE(found.empty());
    }
    if (off_px > 0) {
      EXPECT_EQ(found.size(), 1u);
    }
  }
  // A line of sight on a pixel's edge has an image that does not move.
  for (const double u_px : {19.5, 20.0, 50.5, 79.5})
    EXPECT_LE(q.query.intervals(segment(on(u_px, 40, 0.5), on(u_px, 40, 4)), 0, 1).size(), 1u);
  EXPECT_EQ(q.query.intervals(segment(on(20, 40, 0.5), on(20, 40, 4)), 0, 1).size(), 1u);
}

// The ray touches only the corner of the corner pixel.
TEST_F(SquareQuery, NoZeroLengthIntervalAtACorner) {
  silhouettes.resize(1);
  silhouettes[0] = {{{11, 11, 10, 10, 5, 5}, Eigen::Isometry3d::Identity()}, ObjectPixels(11, 11)};
  silhouettes[0].pixels.set(5, 5);
  const test::Queries q(silhouettes);
  const geometry::Ray touching{{-0.1, 0, 1},
                               {0.1, 0.1, 0}};  // u + v = 9 + 2t... through (4.5, 5.5) at t = 0.5
  for (const Interval& i : q.query.intervals(touching, 0, 1)) EXPECT_LT(i.enter, i.leave);
  const geometry::Ray through{{-3, 0, 1}, {1, 0, 0}};
  const auto found = q.query.intervals(through, 0.5, 10);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found[0].enter, 2.95, 1e-12);
  EXPECT_NEAR(found[0].leave, 3.05, 1e-12);
  EXPECT_TRUE(q.query.intervals({{-3, 0, -1}, {1, 0, 0}}, 0.5, 10).empty());
}

// The pixels share a corner; every number is exact in binary.
TEST(HullQueryRay, OneIntervalThroughDiagonalPixels) {
  Silhouette s{{{16, 16, 16, 16, 8, 8}, Eigen::Isometry3d::Identity()}, ObjectPixels(16, 16)};
  for (int i = 4; i < 12; ++i) s.pixels.set(i, i);
  const test::Queries q(std::vector{s});
  const auto found =
      q.query.intervals({{-0.53125, -0.53125, 1}, {1, 1, 0}}, 0, 1);  // u = v = -0.5 + 16 t
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0], (Interval{0.25, 0.75}));
}

TEST_F(SquareQuery, NotANumberMeetsNothing) {
  fill(0, {0, 0, 100, 75});
  fill(1, {0, 0, 100, 75});
  const test::Queries q(silhouettes);
  EXPECT_TRUE(q.query.intervals({{test::kNaN, 0, 0}, {1, 0, 0}}, 0, 1).empty());
  EXPECT_TRUE(q.query.intervals({{0, 0, 0}, {test::kNaN, 0, 0}}, 0, 1).empty());
  EXPECT_TRUE(q.query.intervals({{0, 0, 0}, {1, 0, 0}}, test::kNaN, 1).empty());
  EXPECT_TRUE(q.query.intervals({{0, 0, 0}, {1, 0, 0}}, 0, kInfinity).empty());
  EXPECT_TRUE(q.query.intervals({{0, 0, 0}, {1, 0, 0}}, 1, 1).empty());
  EXPECT_EQ(q.query.intervals({{0, 0, 0}, {0, 0, 0}}, 0, 1).size(),
            1u);  // the ray is a point in the hull
  silhouettes[0].camera.pinhole.fx_px = test::kNaN;
  const test::Queries bad(silhouettes);
  EXPECT_FALSE(bad.query.contains({0, 0, 0}));
  EXPECT_EQ(bad.query.solid_radius_m({0, 0, 0}), 0);
}

TEST_F(SquareQuery, RaysAndRangesWithoutEndMeetNothing) {
  fill(0, {0, 0, 100, 75});
  fill(1, {0, 0, 100, 75});
  const test::Queries q(silhouettes);
  const geometry::Ray ray{{0.02, 0.01, -1}, {-0.02, 0.03, 1}};
  ASSERT_EQ(q.query.intervals(ray, -9, 9).size(), 1u);
  for (const auto& [near, far] :
       {std::pair{-kInfinity, 9.0}, {-9.0, kInfinity}, {-kInfinity, kInfinity}, {9.0, -9.0}}) {
    EXPECT_TRUE(q.query.intervals(ray, near, far).empty()) << near << ", " << far;
    EXPECT_FALSE(q.query.first_entry(ray, near, far)) << near << ", " << far;
  }
  EXPECT_TRUE(q.query.intervals({{0, 0, -kInfinity}, {0, 0, 1}}, -9, 9).empty());
  EXPECT_TRUE(q.query.intervals({{0, 0, -1}, {0, 0, kInfinity}}, -9, 9).empty());
}

TEST_F(SquareQuery, ExtremeFocalLengthsAtOneKilometreEqualTheReference) {
  test::Random random(9);
  for (const double f : {50.0, 50000.0}) {
    SCOPED_TRACE(f);
    const double distance_m = f > 1000 ? 1000.0 : 1.0;
    silhouettes[0].camera.pinhole.fx_px = silhouettes[0].camera.pinhole.fy_px = f;
    silhouettes[0].camera.camera_from_world = geometry::look_at({distance_m, 0, 0}, {0, 0, 0});
    fill(0, {30, 30, 60, 50});
    fill(1, {10, 10, 90, 70});
    for (const HullRule& rule : test::kRules) {
      const test::Queries q(silhouettes, rule);
      for (int i = 0; i < 200; ++i) {
        const Vector3d p = test::random_in_ball(random, 0.5);
        EXPECT_EQ(q.query.contains(p), in_hull(silhouettes, p, rule));
        test::expect_ball_kept(silhouettes, rule, p, q.query.free_radius_m(p), false, random, 20);
        test::expect_ball_kept(silhouettes, rule, p, q.query.solid_radius_m(p), true, random, 20);
        expect_reference(silhouettes, q.query, segment(test::random_in_ball(random, 2), p), 0, 2);
      }
    }
  }
}

TEST_F(SquareQuery, AllCamerasInOnePlaneEqualTheReference) {
  for (const double angle : {0.4, 1.1, 2.5})
    silhouettes.push_back(
        {{geometry::pinhole_from_fov(100, 75, 0.5),
          geometry::look_at(2 * Vector3d(std::cos(angle), std::sin(angle), 0), {0, 0, 0})},
         ObjectPixels(100, 75)});
  for (int i = 0; i < int(silhouettes.size()); ++i) fill(i, {35, 25, 65, 50});
  const test::Queries q(silhouettes);
  test::Random random(1);
  for (int i = 0; i < 100; ++i) {
    expect_reference(silhouettes, q.query, random_segment(random, 1, 0.1), 0, 2);
    expect_reference(
        silhouettes, q.query,
        {{test::uniform(random, -0.3, 0.3), test::uniform(random, -0.3, 0.3), -1}, {0, 0, 1}}, 0,
        2);
  }
}

// Two people and four cameras at the corners: the ray through all parts has an interval for each.
TEST(HullQueryRay, RayThroughGhostVolumesHasAnIntervalForEach) {
  std::vector<Capsule> people{{{-0.6, 0, 0.2}, {-0.6, 0, 1.5}, 0.2},
                              {{0.6, 0, 0.2}, {0.6, 0, 1.5}, 0.2}};
  std::vector<geometry::Camera> cameras;
  for (const double angle : {0.25, 0.75, 1.25, 1.75})
    cameras.push_back({geometry::pinhole_from_fov(160, 121, 1.0),
                       geometry::look_at({4 * std::cos(angle * std::numbers::pi),
                                          4 * std::sin(angle * std::numbers::pi), 1.0},
                                         {0, 0, 0.9})});
  const auto silhouettes = test::silhouettes_of(people, cameras);
  const test::Queries q(silhouettes);
  const geometry::Ray along_y{{0, -2, 0.9}, {0, 1, 0}}, along_x{{-2, 0, 0.9}, {1, 0, 0}};
  expect_reference(silhouettes, q.query, along_x, 0, 4);
  expect_reference(silhouettes, q.query, along_y, 0, 4);
  EXPECT_GE(q.query.intervals(along_x, 0, 4).size(), 2u);
  EXPECT_EQ(q.query.intervals(along_y, 0, 4).size(), 2u);  // two ghosts, without a person
  EXPECT_TRUE(q.query.contains({0, -0.6, 0.9}));
  for (int i = 0; i < 200; ++i) {
    test::Random random(i + 1);
    const double from_x = test::uniform(random, -2, 2), to_x = test::uniform(random, -2, 2);
    expect_reference(silhouettes, q.query, segment({from_x, -2, 0.9}, {to_x, 2, 1.0}), 0, 1);
  }
}

}  // namespace
}  // namespace fivepipe::hull
