// Points, balls, segments and rays against in_hull(), the reference and objects in closed form; and the hard cases of each.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <thread>

#include "common/hull/hull_query.h"
#include "common/hull/ray_walk.h"
#include "common/hull/reference.h"
#include "tests/hull_scenes.h"

namespace fivepipe {
namespace {

using namespace test;
using Eigen::Vector3d;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();
// Pieces of a ray shorter than this are ties of pixel borders: rounding decides whether they exist. In units of the parameter.
constexpr double kTie = 1e-9;
// How far an interval's end may be from the reference's, where the ray's image does not creep along a border.
constexpr double kAgree = 1e-8;

WorkerPool& test_pool() {
  static WorkerPool pool(2);
  return pool;
}

// A hull and the queries of it.
struct Queries {
  CpuHull hull;
  HullQuery query;
  Queries(std::span<const Silhouette> silhouettes, const HullRule& rule = {}) : hull(test_pool(), silhouettes, rule), query(hull) {}
};

const HullRule kRules[] = {{}, {Limits::seen, 1}, {Limits::seen, 2}, {Limits::seen, 3}};

Vector3d point_in_world(const Camera& camera, const Vector3d& p_camera_m) { return camera.camera_from_world.inverse() * p_camera_m; }

// Points that decide a pixel: on its borders and centre, at depths from hardly in front to far, and behind.
std::vector<Vector3d> hard_points(const Camera& camera, Random& random) {
  const Pinhole& k = camera.pinhole;
  std::vector<Vector3d> points{camera_center_world_m(camera), {kNaN, 0, 0}, {0, kInfinity, 0}, {1e200, 0, 0}, {1000, 20, -30}, {0, 0, 1000}};
  for (const double z_m : {1e-9, -1e-9, 0.0, 0.5, 1.0, -1.0, 1000.0}) {
    points.push_back(point_in_world(camera, {0, 0, z_m}));
    for (int i = 0; i < 12; ++i) {
      const double u_px = std::floor(uniform(random, -2, k.width_px + 2)) + 0.5 * (i % 2), v_px = std::floor(uniform(random, -2, k.height_px + 2)) + 0.5 * (i / 2 % 2);
      points.push_back(point_in_world(camera, {(u_px - k.cx_px) / k.fx_px * z_m, (v_px - k.cy_px) / k.fy_px * z_m, z_m}));
    }
  }
  return points;
}

// A point near the object, about on a ray's way, or anywhere.
Vector3d random_point(Random& random, int i) { return random_in_ball(random, i % 3 == 0 ? 0.2 : i % 3 == 1 ? 0.6 : 3.0); }

// No sampled point of the ball breaks its promise.
void expect_ball_kept(std::span<const Silhouette> silhouettes, const HullRule& rule, const Vector3d& p, double radius_m, bool solid, Random& random, int samples) {
  ASSERT_GE(radius_m, 0);
  for (int i = 0; i < samples && radius_m > 0; ++i) {
    const double r = std::min(radius_m, 100.0) * (i % 2 ? 1 - 1e-12 : std::cbrt(uniform(random, 0, 1)));
    ASSERT_EQ(in_hull(silhouettes, p + r * random_direction(random), rule), solid) << "radius " << radius_m << " m at " << p.transpose();
  }
}

TEST(HullQueryPoint, IsInHullOnRandomRigs) {
  int inside = 0;
  for (int seed = 1; seed <= 40; ++seed) {
    Random random(seed);
    const auto silhouettes = silhouettes_of(random_object(random, 3), random_cameras(random, 1 + seed % 6));
    for (const HullRule& rule : kRules) {
      const Queries q(silhouettes, rule);
      for (int i = 0; i < 2000; ++i) {
        const Vector3d p = random_point(random, i);
        const bool expected = in_hull(silhouettes, p, rule);
        ASSERT_EQ(q.query.contains(p), expected);
        inside += expected;
      }
    }
  }
  EXPECT_GT(inside, 1000);
}

TEST(HullQueryPoint, HardPointsAreInHullToTheBit) {
  for (int seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    std::vector<Silhouette> silhouettes;
    for (const Camera& camera : random_cameras(random, 1 + seed % 4, 40, 31)) silhouettes.push_back({camera, random_pixels(random, 40, 31, 0.5)});
    for (const HullRule& rule : kRules) {
      const Queries q(silhouettes, rule);
      for (const Silhouette& s : silhouettes) {
        const auto points = hard_points(s.camera, random);
        std::vector<std::uint8_t> together(points.size());
        q.query.contains(points, together);
        for (std::size_t i = 0; i < points.size(); ++i) EXPECT_EQ(together[i], in_hull(silhouettes, points[i], rule)) << points[i].transpose();
        for (const Vector3d& p : points) {
          EXPECT_EQ(q.query.contains(p), in_hull(silhouettes, p, rule)) << p.transpose();
          const double free_m = q.query.free_radius_m(p), solid_m = q.query.solid_radius_m(p);
          EXPECT_GE(free_m, 0);
          EXPECT_GE(solid_m, 0);
          EXPECT_FALSE(free_m > 0 && solid_m > 0);
          if (!p.allFinite()) { EXPECT_TRUE(free_m == 0 && solid_m == 0); }
          else if (p.norm() < 1e6) {
            expect_ball_kept(silhouettes, rule, p, free_m, false, random, 6);
            expect_ball_kept(silhouettes, rule, p, solid_m, true, random, 6);
          }
        }
      }
    }
  }
}

TEST(HullQueryPoint, MapsOfSizeZeroAndOne) {
  Random random(4);
  for (const int size : {0, 1})
    for (const bool object : {false, true}) {
      if (size == 0 && object) continue;
      Silhouette s{{{size, size, 100, 100, 0, 0}, look_at({2, 0, 0}, {0, 0, 0})}, ObjectPixels(size, size)};
      if (object) s.pixels.set(0, 0);
      const std::vector<Silhouette> silhouettes{s, s};
      for (const HullRule& rule : kRules) {
        const Queries q(silhouettes, rule);
        const bool expected = object && rule.min_seen <= 2;
        EXPECT_EQ(q.query.contains({0, 0, 0}), expected);
        EXPECT_EQ(q.query.solid_radius_m({0, 0, 0}) > 0, expected);
        EXPECT_EQ(q.query.free_radius_m({0, 0, 0}) > 0, !expected);
        const Ray ray{{0, -3, 0}, {0, 1, 0}};
        EXPECT_EQ(q.query.intervals(ray, 0, 6).size(), reference_intervals(silhouettes, ray, 0, 6, rule).size());
        for (int i = 0; i < 50; ++i) {
          const Vector3d p = random_point(random, i);
          expect_ball_kept(silhouettes, rule, p, q.query.free_radius_m(p), false, random, 10);
          expect_ball_kept(silhouettes, rule, p, q.query.solid_radius_m(p), true, random, 10);
        }
      }
    }
}

TEST(HullQueryPoint, NoCameraAndNoObjectPixel) {
  const Queries none(std::vector<Silhouette>{});
  EXPECT_FALSE(none.query.contains({0, 0, 0}));
  EXPECT_EQ(none.query.free_radius_m({0, 0, 0}), kInfinity);
  EXPECT_EQ(none.query.solid_radius_m({0, 0, 0}), 0);
  EXPECT_TRUE(none.query.intervals({{0, 0, 0}, {1, 0, 0}}, 0, 1).empty());
  Random random(2);
  auto silhouettes = silhouettes_of(random_object(random, 2), random_cameras(random, 3));
  silhouettes[1].pixels = ObjectPixels(160, 121);
  const Queries blind(silhouettes);
  EXPECT_EQ(blind.query.free_radius_m({0, 0, 0}), kInfinity);
  EXPECT_FALSE(blind.query.contains({0, 0, 0}));
}

TEST(HullQueryBall, PromisesAreKeptOnEveryNumberOfCameras) {
  for (const int cameras : {1, 2, 3, 4, 16, 64}) {
    SCOPED_TRACE(cameras);
    Random random(cameras);
    const auto silhouettes = silhouettes_of(random_object(random, 3), random_cameras(random, cameras, 80, 60));
    for (const HullRule& rule : kRules) {
      const Queries q(silhouettes, rule);
      int free = 0, solid = 0;
      for (int i = 0; i < 200; ++i) {
        const Vector3d p = random_point(random, i);
        const double free_m = q.query.free_radius_m(p), solid_m = q.query.solid_radius_m(p);
        expect_ball_kept(silhouettes, rule, p, free_m, false, random, 40);
        expect_ball_kept(silhouettes, rule, p, solid_m, true, random, 40);
        free += free_m > 0, solid += solid_m > 0;
        EXPECT_TRUE(in_hull(silhouettes, p, rule) ? free_m == 0 : solid_m == 0);
      }
      EXPECT_GT(free, 20);
    }
  }
}

// To rounding within a pixel; farther away at least half of it, for the reaches that are told apart double. Or a sphere tracer would crawl.
TEST(HullQueryBall, ReachesToTheBorderOfAPixel) {
  Silhouette s{{{101, 101, 100, 100, 50, 50}, Eigen::Isometry3d::Identity()}, ObjectPixels(101, 101)};
  for (int v = 0; v < 101; ++v)
    for (int u = 50; u < 101; ++u) s.pixels.set(u, v);  // the half-space right of the plane u = 49.5: x = -z / 200
  const Queries q(std::vector{s});
  for (const double across_m : {1e-10, 1e-6, 1e-3, 0.05, 0.2}) {
    const Vector3d normal = Vector3d(200, 0, 1).normalized(), on_plane(-1.0 / 200, 0, 1);
    EXPECT_NEAR(q.query.free_radius_m(on_plane - across_m * normal), across_m, 1e-12);
    const double solid_m = q.query.solid_radius_m(on_plane + across_m * normal);
    EXPECT_LE(solid_m, across_m);
    EXPECT_GE(solid_m, across_m < 0.005 ? across_m - 1e-12 : 0.5 * across_m);
  }
  s.camera.camera_from_world.linear() *= 1.0004;  // the same plane, of a rotation that stretches
  const Queries stretched(std::vector{s});
  const Vector3d inside = Vector3d(-1.0 / 200, 0, 1) + 1e-3 * Vector3d(200, 0, 1).normalized();
  EXPECT_LE(stretched.query.solid_radius_m(inside), 1e-3);
  EXPECT_GE(stretched.query.solid_radius_m(inside), 1e-3 / 1.0005);
}

TEST(HullQueryBall, BehindACameraItsPlaneIsFreeUpTo) {
  Silhouette s{{{11, 11, 1, 1, 5, 5}, Eigen::Isometry3d::Identity()}, ObjectPixels(11, 11)};  // so wide that the sides say little
  for (int v = 0; v < 11; ++v)
    for (int u = 0; u < 11; ++u) s.pixels.set(u, v);
  const Queries q(std::vector{s});
  EXPECT_NEAR(q.query.free_radius_m({0, 0, -0.7}), 0.7, 1e-12);
  EXPECT_EQ(q.query.free_radius_m({0, 0, 0}), 0);
}

TEST(HullQueryBall, SphereTracingComesToTheEntry) {
  int hits = 0;
  for (int seed = 1; seed <= 10; ++seed) {
    Random random(seed);
    const auto silhouettes = silhouettes_of(random_object(random, 3), random_cameras(random, 4));
    const Queries q(silhouettes);
    const View view{random_camera(random, 30, 20, 0.8), 0.05, 3.0};
    for (int i = 0; i < 600; ++i) {
      const Ray ray = ray_through(view.camera, Eigen::Vector2d(i % 30, i / 30));
      const auto entry = q.query.first_entry(ray, view.near_m, view.far_m);
      const double length = ray.direction_world.norm();
      double t = view.near_m;
      for (int step = 0; step < 400 && t < view.far_m; ++step) t += q.query.free_radius_m(ray.origin_world_m + t * ray.direction_world) / length;
      EXPECT_LE(t, entry.value_or(kInfinity) + 1e-12);
      if (entry) { EXPECT_GT(t, *entry - 0.01); }  // grazing rays crawl; most are there
      hits += entry && t > *entry - 1e-6;
    }
  }
  EXPECT_GT(hits, 400);
}

TEST(HullQueryBall, RotationOffOrthonormalStretchesNothing) {
  Random random(6);
  auto silhouettes = silhouettes_of(random_object(random, 3), random_cameras(random, 2));
  for (Silhouette& s : silhouettes) s.camera.camera_from_world.linear() *= 1.0004;
  const Queries q(silhouettes);
  for (int i = 0; i < 300; ++i) {
    const Vector3d p = random_point(random, i);
    expect_ball_kept(silhouettes, {}, p, q.query.free_radius_m(p), false, random, 100);
    expect_ball_kept(silhouettes, {}, p, q.query.solid_radius_m(p), true, random, 100);
  }
}

// What the hull of touched maps surely holds, and does not: the object, and what a camera sees two pixels beside it.
TEST(HullQueryBall, CapsulesInClosedForm) {
  const std::vector<Capsule> ball{{{0, 0, 0}, {0, 0, 0}, 0.1}};
  std::vector<Camera> cameras;
  for (const double angle : {0.3, 1.5, 2.9}) cameras.push_back({pinhole_from_fov(800, 800, 0.4), look_at(1.5 * Vector3d(std::cos(angle), std::sin(angle), 0.5), {0, 0, 0})});
  const Queries q(silhouettes_of(ball, cameras));
  const double footprint_m = 1.7 / cameras[0].pinhole.fx_px;
  Random random(3);
  EXPECT_GT(q.query.solid_radius_m({0, 0, 0}), 0.05);  // 65 px of 0.9 mm
  for (int i = 0; i < 2000; ++i) {
    const Vector3d p = random_in_ball(random, 0.4);
    if (p.norm() < 0.1 - 1e-9) { EXPECT_TRUE(q.query.contains(p)); }
    if (q.query.free_radius_m(p) > 0) { EXPECT_GT(p.norm(), 0.1 - 1e-9); }
    const double solid_m = q.query.solid_radius_m(p);
    for (int k = 0; k < 10 && solid_m > 2 * footprint_m; ++k) EXPECT_TRUE(in_analytic_hull(ball, cameras, p + (solid_m - 2 * footprint_m) * random_direction(random)));
  }
}

// --- rays ------------------------------------------------------------------------------------------------------

// Both without pieces that are ties.
std::vector<Interval> without_ties(std::vector<Interval> pieces, double tie) {
  std::vector<Interval> joined;
  for (const Interval& i : pieces)
    if (!joined.empty() && i.enter - joined.back().leave <= tie) joined.back().leave = i.leave;
    else joined.push_back(i);
  std::erase_if(joined, [tie](const Interval& i) { return i.leave - i.enter <= tie; });
  return joined;
}

void expect_reference(std::span<const Silhouette> silhouettes, const HullQuery& query, const Ray& ray, double near, double far, double scale = 1) {
  const HullRule& rule = query.hull().rule();
  const auto found = query.intervals(ray, near, far);
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_LT(found[i].enter, found[i].leave);
    if (i > 0) { EXPECT_LT(found[i - 1].leave, found[i].enter); }
  }
  EXPECT_EQ(query.first_entry(ray, near, far), found.empty() ? std::nullopt : std::optional(found.front().enter));
  const auto mine = without_ties(found, kTie * scale), expected = without_ties(reference_intervals(silhouettes, ray, near, far, rule), kTie * scale);
  ASSERT_EQ(mine.size(), expected.size());
  for (std::size_t i = 0; i < mine.size(); ++i) {
    EXPECT_NEAR(mine[i].enter, expected[i].enter, kAgree * scale);
    EXPECT_NEAR(mine[i].leave, expected[i].leave, kAgree * scale);
  }
}

TEST(HullQueryRay, IsTheReferenceOnRandomRigs) {  // any direction and length, origins behind cameras and inside the hull
  for (int seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const auto silhouettes = silhouettes_of(random_object(random, 3), random_cameras(random, 1 + seed % 6, 96, 67));
    for (const HullRule& rule : kRules) {
      const Queries q(silhouettes, rule);
      for (int i = 0; i < 25; ++i) {
        const double length = std::pow(10.0, uniform(random, -3, 3));
        const Vector3d from = random_point(random, i), to = random_in_ball(random, 0.3);
        expect_reference(silhouettes, q.query, {from, length * (to - from).normalized()}, i % 2 ? 0 : -1 / length, 4 / length, 1 / length);
        expect_reference(silhouettes, q.query, segment(from, to), 0, 1);
      }
    }
  }
}

TEST(HullQueryRay, IsTheReferenceOnNoise) {
  for (int seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    std::vector<Silhouette> silhouettes;
    for (const Camera& camera : random_cameras(random, 3, 90, 67)) silhouettes.push_back({camera, random_pixels(random, 90, 67, std::vector{0.05, 0.4, 0.9}[seed % 3])});
    for (const HullRule& rule : kRules) {
      const Queries q(silhouettes, rule);
      for (int i = 0; i < 40; ++i) expect_reference(silhouettes, q.query, segment(random_in_ball(random, 2), random_in_ball(random, 0.3)), 0, 2);
    }
  }
}

TEST(HullQueryRay, AgreesWithPoints) {
  int inside = 0;
  for (int seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    const auto silhouettes = silhouettes_of(random_object(random, 3), random_cameras(random, 1 + seed % 5));
    for (const HullRule& rule : kRules) {
      const Queries q(silhouettes, rule);
      for (int i = 0; i < 20; ++i) {
        const Ray ray = segment(random_in_ball(random, 2), random_in_ball(random, 0.2));
        const auto found = q.query.intervals(ray, 0, 1.5);
        for (int k = 0; k < 60; ++k) {
          const double t = uniform(random, 0, 1.5);
          const bool expected = std::any_of(found.begin(), found.end(), [&](const Interval& x) { return x.enter <= t && t < x.leave; });
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
    for (const Vector3d& eye : {Vector3d(2, 0, 0), Vector3d(0, 2, 0)}) silhouettes.push_back({{pinhole_from_fov(100, 75, 0.5), look_at(eye, {0, 0, 0})}, ObjectPixels(100, 75)});
  }
  void fill(int camera, const PixelRect& r) {
    for (int v = r.v0_px; v < r.v1_px; ++v)
      for (int u = r.u0_px; u < r.u1_px; ++u) silhouettes[std::size_t(camera)].pixels.set(u, v);
  }
};

TEST_F(SquareQuery, RayThroughACameraCentre) {
  fill(0, {10, 10, 90, 70});
  fill(1, {10, 10, 90, 70});
  for (const HullRule& rule : kRules) {
    const Queries q(silhouettes, rule);
    for (const Vector3d& direction : {Vector3d(-1, 0.001, 0.002), Vector3d(-1, 0.1, 0.3), Vector3d(1, 0.1, 0.3), Vector3d(0.3, 1, 0.1)})
      expect_reference(silhouettes, q.query, {Vector3d(2, 0, 0) - direction, direction}, 0, 5);
  }
}

TEST_F(SquareQuery, RayTangentToASilhouette) {  // in the plane of a row's upper border: one side or the other, without a gap
  fill(0, {20, 20, 80, 60});
  fill(1, {20, 20, 80, 60});
  const Camera& c = silhouettes[0].camera;
  const Queries q(silhouettes);
  const auto on = [&](double u_px, double v_px, double z_m) { return point_in_world(c, {(u_px - c.pinhole.cx_px) / c.pinhole.fx_px * z_m, (v_px - c.pinhole.cy_px) / c.pinhole.fy_px * z_m, z_m}); };
  for (const double off_px : {-1e-6, 0.0, 1e-6}) {
    const auto found = q.query.intervals(segment(on(10, 19.5 + off_px, 1.9), on(90, 19.5 + off_px, 2.05)), 0, 1);
    EXPECT_LE(found.size(), 1u);
    if (off_px < 0) { EXPECT_TRUE(found.empty()); }
    if (off_px > 0) { EXPECT_EQ(found.size(), 1u); }
  }
  // A line of sight on a pixel's edge stands still in the image.
  for (const double u_px : {19.5, 20.0, 50.5, 79.5}) EXPECT_LE(q.query.intervals(segment(on(u_px, 40, 0.5), on(u_px, 40, 4)), 0, 1).size(), 1u);
  EXPECT_EQ(q.query.intervals(segment(on(20, 40, 0.5), on(20, 40, 4)), 0, 1).size(), 1u);
}

TEST_F(SquareQuery, NoPieceOfLengthZeroAtACorner) {  // touches the corner pixel's corner only
  silhouettes.resize(1);
  silhouettes[0] = {{{11, 11, 10, 10, 5, 5}, Eigen::Isometry3d::Identity()}, ObjectPixels(11, 11)};
  silhouettes[0].pixels.set(5, 5);
  const Queries q(silhouettes);
  const Ray touching{{-0.1, 0, 1}, {0.1, 0.1, 0}};  // u + v = 9 + 2t... through (4.5, 5.5) at t = 0.5
  for (const Interval& i : q.query.intervals(touching, 0, 1)) EXPECT_LT(i.enter, i.leave);
  const Ray through{{-3, 0, 1}, {1, 0, 0}};
  const auto found = q.query.intervals(through, 0.5, 10);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found[0].enter, 2.95, 1e-12);
  EXPECT_NEAR(found[0].leave, 3.05, 1e-12);
  EXPECT_TRUE(q.query.intervals({{-3, 0, -1}, {1, 0, 0}}, 0.5, 10).empty());
}

TEST(HullQueryRay, OnePieceThroughCornersOfPixels) {  // pixels that touch at a corner; every number is exact in binary
  Silhouette s{{{16, 16, 16, 16, 8, 8}, Eigen::Isometry3d::Identity()}, ObjectPixels(16, 16)};
  for (int i = 4; i < 12; ++i) s.pixels.set(i, i);
  const Queries q(std::vector{s});
  const auto found = q.query.intervals({{-0.53125, -0.53125, 1}, {1, 1, 0}}, 0, 1);  // u = v = -0.5 + 16 t
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0], (Interval{0.25, 0.75}));
}

TEST_F(SquareQuery, NotANumberMeetsNothing) {
  fill(0, {0, 0, 100, 75});
  fill(1, {0, 0, 100, 75});
  const Queries q(silhouettes);
  EXPECT_TRUE(q.query.intervals({{kNaN, 0, 0}, {1, 0, 0}}, 0, 1).empty());
  EXPECT_TRUE(q.query.intervals({{0, 0, 0}, {kNaN, 0, 0}}, 0, 1).empty());
  EXPECT_TRUE(q.query.intervals({{0, 0, 0}, {1, 0, 0}}, kNaN, 1).empty());
  EXPECT_TRUE(q.query.intervals({{0, 0, 0}, {1, 0, 0}}, 0, kInfinity).empty());
  EXPECT_TRUE(q.query.intervals({{0, 0, 0}, {1, 0, 0}}, 1, 1).empty());
  EXPECT_EQ(q.query.intervals({{0, 0, 0}, {0, 0, 0}}, 0, 1).size(), 1u);  // a point, all along
  silhouettes[0].camera.pinhole.fx_px = kNaN;
  const Queries bad(silhouettes);
  EXPECT_FALSE(bad.query.contains({0, 0, 0}));
  EXPECT_EQ(bad.query.solid_radius_m({0, 0, 0}), 0);
}

TEST_F(SquareQuery, ExtremeFocalLengthsAndAKilometre) {
  Random random(9);
  for (const double f : {50.0, 50000.0}) {
    SCOPED_TRACE(f);
    const double distance_m = f > 1000 ? 1000.0 : 1.0;
    silhouettes[0].camera.pinhole.fx_px = silhouettes[0].camera.pinhole.fy_px = f;
    silhouettes[0].camera.camera_from_world = look_at({distance_m, 0, 0}, {0, 0, 0});
    fill(0, {30, 30, 60, 50});
    fill(1, {10, 10, 90, 70});
    for (const HullRule& rule : kRules) {
      const Queries q(silhouettes, rule);
      for (int i = 0; i < 200; ++i) {
        const Vector3d p = random_in_ball(random, 0.5);
        EXPECT_EQ(q.query.contains(p), in_hull(silhouettes, p, rule));
        expect_ball_kept(silhouettes, rule, p, q.query.free_radius_m(p), false, random, 20);
        expect_ball_kept(silhouettes, rule, p, q.query.solid_radius_m(p), true, random, 20);
        expect_reference(silhouettes, q.query, segment(random_in_ball(random, 2), p), 0, 2);
      }
    }
  }
}

TEST_F(SquareQuery, AllCamerasInOnePlane) {
  for (const double angle : {0.4, 1.1, 2.5})
    silhouettes.push_back({{pinhole_from_fov(100, 75, 0.5), look_at(2 * Vector3d(std::cos(angle), std::sin(angle), 0), {0, 0, 0})}, ObjectPixels(100, 75)});
  for (int i = 0; i < int(silhouettes.size()); ++i) fill(i, {35, 25, 65, 50});
  const Queries q(silhouettes);
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    expect_reference(silhouettes, q.query, segment(random_in_ball(random, 1), random_in_ball(random, 0.1)), 0, 2);
    expect_reference(silhouettes, q.query, {{uniform(random, -0.3, 0.3), uniform(random, -0.3, 0.3), -1}, {0, 0, 1}}, 0, 2);
  }
}

TEST(HullQueryRay, GhostVolumes) {  // two people, four cameras at the corners: the ray through all parts counts them
  std::vector<Capsule> people{{{-0.6, 0, 0.2}, {-0.6, 0, 1.5}, 0.2}, {{0.6, 0, 0.2}, {0.6, 0, 1.5}, 0.2}};
  std::vector<Camera> cameras;
  for (const double angle : {0.25, 0.75, 1.25, 1.75}) cameras.push_back({pinhole_from_fov(160, 121, 1.0), look_at({4 * std::cos(angle * std::numbers::pi), 4 * std::sin(angle * std::numbers::pi), 1.0}, {0, 0, 0.9})});
  const auto silhouettes = silhouettes_of(people, cameras);
  const Queries q(silhouettes);
  const Ray along_y{{0, -2, 0.9}, {0, 1, 0}}, along_x{{-2, 0, 0.9}, {1, 0, 0}};
  expect_reference(silhouettes, q.query, along_x, 0, 4);
  expect_reference(silhouettes, q.query, along_y, 0, 4);
  EXPECT_GE(q.query.intervals(along_x, 0, 4).size(), 2u);
  EXPECT_EQ(q.query.intervals(along_y, 0, 4).size(), 2u);  // two ghosts, where nobody is
  EXPECT_TRUE(q.query.contains({0, -0.6, 0.9}));
  for (int i = 0; i < 200; ++i) {
    Random random(i + 1);
    expect_reference(silhouettes, q.query, segment({uniform(random, -2, 2), -2, 0.9}, {uniform(random, -2, 2), 2, 1.0}), 0, 1);
  }
}

// --- many --------------------------------------------------------------------------------------------------------

TEST(HullQueryMany, TheSameBitsAsOneByOneOnAnyNumberOfThreads) {
  Random random(12);
  const auto silhouettes = silhouettes_of(random_object(random, 3), random_cameras(random, 4));
  std::vector<Vector3d> points;
  std::vector<Ray> rays;
  for (int i = 0; i < 5000; ++i) points.push_back(random_point(random, i)), rays.push_back(segment(random_point(random, i), random_in_ball(random, 0.2)));
  points[17].x() = kNaN;
  for (const HullRule& rule : kRules)
    for (const int threads : {1, 2, 5}) {
      WorkerPool pool(threads);
      CpuHull hull(pool, silhouettes, rule);
      const HullQuery query(hull);
      std::vector<std::uint8_t> inside(points.size());
      std::vector<double> free_m(points.size()), solid_m(points.size()), entry(rays.size());
      query.contains(points, inside);
      query.free_radius_m(points, free_m);
      query.solid_radius_m(points, solid_m);
      query.first_entry(rays, 0, 1, entry);
      for (std::size_t i = 0; i < points.size(); ++i) {
        ASSERT_EQ(inside[i], in_hull(silhouettes, points[i], rule));
        ASSERT_EQ(free_m[i], query.free_radius_m(points[i]));
        ASSERT_EQ(solid_m[i], query.solid_radius_m(points[i]));
        ASSERT_EQ(entry[i], query.first_entry(rays[i], 0, 1).value_or(kNever));
      }
      query.contains({}, {});
    }
}

TEST(HullQueryMany, SeveralThreadsMayAskAtOnce) {
  Random random(13);
  const auto silhouettes = silhouettes_of(random_object(random, 3), random_cameras(random, 4));
  const Queries q(silhouettes);
  std::vector<int> wrong(4, 0);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      Random mine(t + 1);
      for (int i = 0; i < 3000; ++i) {
        const Vector3d p = random_point(mine, i);
        const bool expected = in_hull(silhouettes, p);
        wrong[std::size_t(t)] += q.query.contains(p) != expected || (expected ? q.query.free_radius_m(p) : q.query.solid_radius_m(p)) > 0;
      }
    });
  for (std::thread& t : threads) t.join();
  EXPECT_EQ(wrong, std::vector<int>(4, 0));
}

}  // namespace
}  // namespace fivepipe
