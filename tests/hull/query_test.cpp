// HullQuery for points, balls and many points, against in_hull() and closed forms, and its hard
// cases.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "common/hull/cpu/ray_walk.h"
#include "tests/support/hull/queries.h"
#include "tests/support/not_finite.h"

namespace fivepipe::hull {
namespace {

using namespace test;
using Eigen::Vector3d;

// Points on the borders and at the centre of pixels, at depths from just in front of the camera to
// far away, and behind it.
std::vector<Vector3d> hard_points(const geometry::Camera& camera, test::Random& random) {
  const geometry::Pinhole& k = camera.pinhole;
  std::vector<Vector3d> points{geometry::camera_center_world_m(camera),
                               {test::kNaN, 0, 0},
                               {0, kInfinity, 0},
                               {1e200, 0, 0},
                               {1000, 20, -30},
                               {0, 0, 1000}};
  for (const double z_m : {1e-9, -1e-9, 0.0, 0.5, 1.0, -1.0, 1000.0}) {
    points.push_back(test::point_in_world(camera, {0, 0, z_m}));
    for (int i = 0; i < 12; ++i) {
      const double u_px = std::floor(test::uniform(random, -2, k.width_px + 2)) + 0.5 * (i % 2),
                   v_px =
                       std::floor(test::uniform(random, -2, k.height_px + 2)) + 0.5 * (i / 2 % 2);
      points.push_back(test::point_in_world(
          camera, {(u_px - k.cx_px) / k.fx_px * z_m, (v_px - k.cy_px) / k.fy_px * z_m, z_m}));
    }
  }
  return points;
}

TEST(HullQueryPoint, IsInHullOnRandomRigs) {
  int inside = 0;
  for (int seed = 1; seed <= 40; ++seed) {
    test::Random random(seed);
    const auto silhouettes = test::silhouettes_of(
        {test::random_cameras(random, 1 + seed % 6), test::random_object(random, 3)});
    for (const HullRule& rule : test::kRules) {
      const test::Queries q(silhouettes, rule);
      for (int i = 0; i < 2000; ++i) {
        const Vector3d p = test::random_point(random, i);
        const bool expected = in_hull(silhouettes, p, rule);
        ASSERT_EQ(q.query.contains(p), expected);
        inside += expected;
      }
    }
  }
  EXPECT_GT(inside, 1000);
}

TEST(HullQueryPoint, DegeneratePointsMatchInHullBitForBit) {
  for (int seed = 1; seed <= 20; ++seed) {
    test::Random random(seed);
    std::vector<Silhouette> silhouettes;
    for (const geometry::Camera& camera : test::random_cameras(random, 1 + seed % 4, 40, 31))
      silhouettes.push_back({camera, test::random_pixels(random, 40, 31, 0.5)});
    for (const HullRule& rule : test::kRules) {
      const test::Queries q(silhouettes, rule);
      for (const Silhouette& s : silhouettes) {
        const auto points = hard_points(s.camera, random);
        std::vector<std::uint8_t> together(points.size());
        q.query.contains(points, together);
        for (std::size_t i = 0; i < points.size(); ++i)
          EXPECT_EQ(together[i], in_hull(silhouettes, points[i], rule)) << points[i].transpose();
        for (const Vector3d& p : points) {
          EXPECT_EQ(q.query.contains(p), in_hull(silhouettes, p, rule)) << p.transpose();
          const double free_m = q.query.free_radius_m(p), solid_m = q.query.solid_radius_m(p);
          EXPECT_GE(free_m, 0);
          EXPECT_GE(solid_m, 0);
          EXPECT_FALSE(free_m > 0 && solid_m > 0);
          if (!p.allFinite()) {
            EXPECT_TRUE(free_m == 0 && solid_m == 0);
          } else if (p.norm() < 1e6) {
            test::expect_ball_kept(silhouettes, rule, p, free_m, false, random, 6);
            test::expect_ball_kept(silhouettes, rule, p, solid_m, true, random, 6);
          }
        }
      }
    }
  }
}

TEST(HullQueryPoint, MapsOfSizeZeroAndOneMatchInHull) {
  test::Random random(4);
  for (const int size : {0, 1})
    for (const bool object : {false, true}) {
      if (size == 0 && object) continue;
      Silhouette s{{{size, size, 100, 100, 0, 0}, geometry::look_at({2, 0, 0}, {0, 0, 0})},
                   ObjectPixels(size, size)};
      if (object) s.pixels.set(0, 0);
      const std::vector<Silhouette> silhouettes{s, s};
      for (const HullRule& rule : test::kRules) {
        const test::Queries q(silhouettes, rule);
        const bool expected = object && rule.min_seen <= 2;
        EXPECT_EQ(q.query.contains({0, 0, 0}), expected);
        EXPECT_EQ(q.query.solid_radius_m({0, 0, 0}) > 0, expected);
        EXPECT_EQ(q.query.free_radius_m({0, 0, 0}) > 0, !expected);
        EXPECT_EQ(q.query.intervals({{0, -3, 0}, {0, 1, 0}}, 0, 6).size(), expected);
        for (int i = 0; i < 50; ++i) {
          const Vector3d p = test::random_point(random, i);
          test::expect_ball_kept(silhouettes, rule, p, q.query.free_radius_m(p), false, random, 10);
          test::expect_ball_kept(silhouettes, rule, p, q.query.solid_radius_m(p), true, random, 10);
        }
      }
    }
}

TEST(HullQueryPoint, NoCameraAndNoObjectPixelHaveNoHull) {
  const test::Queries none(std::vector<Silhouette>{});
  EXPECT_FALSE(none.query.contains({0, 0, 0}));
  EXPECT_EQ(none.query.free_radius_m({0, 0, 0}), kInfinity);
  EXPECT_EQ(none.query.solid_radius_m({0, 0, 0}), 0);
  EXPECT_TRUE(none.query.intervals({{0, 0, 0}, {1, 0, 0}}, 0, 1).empty());
  test::Random random(2);
  auto silhouettes =
      test::silhouettes_of({test::random_cameras(random, 3), test::random_object(random, 2)});
  silhouettes[1].pixels = ObjectPixels(160, 121);
  const test::Queries blind(silhouettes);
  EXPECT_EQ(blind.query.free_radius_m({0, 0, 0}), kInfinity);
  EXPECT_FALSE(blind.query.contains({0, 0, 0}));
}

TEST(HullQueryBall, BallsAreUniformForEveryCameraCount) {
  for (const int cameras : {1, 2, 3, 4, 16, 64}) {
    SCOPED_TRACE(cameras);
    test::Random random(cameras);
    const auto silhouettes = test::silhouettes_of(
        {test::random_cameras(random, cameras, 80, 60), test::random_object(random, 3)});
    for (const HullRule& rule : test::kRules) {
      const test::Queries q(silhouettes, rule);
      int free = 0, solid = 0;
      for (int i = 0; i < 200; ++i) {
        const Vector3d p = test::random_point(random, i);
        const double free_m = q.query.free_radius_m(p), solid_m = q.query.solid_radius_m(p);
        test::expect_ball_kept(silhouettes, rule, p, free_m, false, random, 40);
        test::expect_ball_kept(silhouettes, rule, p, solid_m, true, random, 40);
        free += free_m > 0, solid += solid_m > 0;
        EXPECT_TRUE(in_hull(silhouettes, p, rule) ? free_m == 0 : solid_m == 0);
      }
      EXPECT_GT(free, 20);
    }
  }
}

// A camera's bounds for the surroundings of a point, and the radii that follow from them, as
// hull_query.h describes them. The radii are the largest that these bounds give: smaller ones would
// slow down sphere tracing.
struct Surroundings {
  bool sees = false, object = false;
  double off_object_m = 0, on_object_m = 0, to_image_border_m = kInfinity;
};

Surroundings surroundings(const CpuHull::MapCamera& c, bool limits_seen,
                          const Vector3d& p_world_m) {
  const SkipMap& map = c.skip_map;
  const ImageCone cone(c.camera);
  const ProjectedPoint p = cone.see(p_world_m);
  const PixelRect image = image_of(c.camera);
  const auto uv = geometry::project(c.camera, p_world_m);
  Surroundings found;
  found.sees = uv && holds(image, uv->x(), uv->y());
  if (limits_seen && !image.empty())
    found.to_image_border_m =
        found.sees ? cone.inside_m(p, cone.pyramid(image)) : cone.outside_m(p, cone.pyramid(image));
  found.off_object_m = map.bounds().empty()
                           ? kInfinity
                           : std::max(0.0, cone.outside_m(p, cone.pyramid(map.bounds())));
  if (!uv || !holds(map.stored(), uv->x(), uv->y())) return found;
  const int u = int(std::lround(uv->x() + 1000)) - 1000,
            v = int(std::lround(uv->y() + 1000)) - 1000;
  const auto extent = [&](Quadrant box) { return std::abs(map.at(box, u, v)); };
  const int right = std::min(extent(Quadrant::right_down), extent(Quadrant::right_up)),
            left = std::min(extent(Quadrant::left_down), extent(Quadrant::left_up)),
            down = std::min(extent(Quadrant::right_down), extent(Quadrant::left_down)),
            up = std::min(extent(Quadrant::right_up), extent(Quadrant::left_up));
  found.object = map.at(Quadrant::left_up, u, v) < 0;
  double border_m = cone.inside_m(p, cone.pyramid({u - left + 1, v - up + 1, u + right, v + down}));
  if (right == 1 || left == 1 || down == 1 || up == 1) {  // tests the adjacent pixels
    double other_m = cone.inside_m(p, cone.pyramid({u - 1, v - 1, u + 2, v + 2}));
    for (const int dv : {-1, 0, 1})
      for (const int du : {-1, 0, 1})
        if ((map.at(Quadrant::left_up, u + du, v + dv) < 0) != found.object)
          other_m = std::min(
              other_m, cone.outside_m(p, cone.pyramid({u + du, v + dv, u + du + 1, v + dv + 1})));
    border_m = std::max(border_m, other_m);
  }
  if (found.object)
    found.on_object_m = border_m;
  else
    found.off_object_m = std::max(found.off_object_m, border_m);
  return found;
}

struct Radii {
  double free_m = 0, solid_m = 0;
};
Radii radii_of(const CpuHull& hull, const Vector3d& p) {
  const HullRule& rule = hull.rule();
  const bool all = rule.limits == Limits::all;
  const int cameras = int(hull.cameras().size()), needed = all ? cameras : rule.min_seen;
  std::vector<double> off;
  Radii radii{0, kInfinity};
  int seen = 0;
  for (const CpuHull::MapCamera& c : hull.cameras()) {
    const Surroundings s = surroundings(c, !all, p);
    off.push_back(s.off_object_m);
    seen += s.sees;
    if (!all && s.sees && !s.object)
      radii.free_m = std::max(radii.free_m, std::min(s.off_object_m, s.to_image_border_m));
    radii.solid_m = std::min(radii.solid_m, all || s.sees ? s.on_object_m : s.to_image_border_m);
  }
  std::sort(off.begin(), off.end());
  if (needed > cameras) radii.free_m = kInfinity;
  if (needed > 0 && needed <= cameras)
    radii.free_m = std::max(radii.free_m, off[std::size_t(needed - 1)]);
  if (!(radii.solid_m > 0) || (!all && seen < rule.min_seen)) radii.solid_m = 0;
  if (hull.empty()) radii = {kInfinity, 0};
  return radii;
}

TEST(HullQueryBall, RadiiAreTheBoundsOfTheCameras) {
  std::vector<HullRule> rules(std::begin(test::kRules), std::end(test::kRules));
  rules.push_back({Limits::seen, 0}), rules.push_back({Limits::seen, -1});
  int free = 0, solid = 0;
  for (int seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(seed);
    test::Random random(seed);
    const auto cameras = test::random_cameras(random, 1 + seed % 4, 40, 31);
    auto silhouettes = test::silhouettes_of(test::random_object(random, 3, 0.3), cameras);
    if (seed % 3 == 0)  // noise, so that most pixels have a neighbour of the other kind
      for (Silhouette& s : silhouettes)
        s.pixels = test::random_pixels(random, 40, 31, seed % 2 ? 0.5 : 0.95);
    if (seed % 4 == 3) silhouettes.back().pixels = ObjectPixels(40, 31);
    for (const HullRule& rule : rules) {
      const test::Queries q(silhouettes, rule);
      for (int i = 0; i < 150; ++i) {
        const Vector3d p = test::random_point(random, i);
        const Radii expected = radii_of(q.hull, p);
        const double free_m = q.query.free_radius_m(p), solid_m = q.query.solid_radius_m(p);
        ASSERT_DOUBLE_EQ(free_m, expected.free_m) << p.transpose();
        ASSERT_DOUBLE_EQ(solid_m, expected.solid_m) << p.transpose();
        free += free_m > 0, solid += solid_m > 0;
      }
    }
  }
  EXPECT_GT(free, 3000);
  EXPECT_GT(solid, 300);
}

TEST(HullQueryBall, IsZeroBeyondARadiusThatMayOverflow) {
  test::Random random(2);
  const test::Queries q(
      test::silhouettes_of({test::random_cameras(random, 3), test::random_object(random, 2)}));
  EXPECT_GT(q.query.free_radius_m({0, 0.9e100, 0}), 1e90);
  EXPECT_EQ(q.query.free_radius_m({0, 1.1e100, 0}), 0);
  EXPECT_EQ(q.query.free_radius_m({0, 0, -1.1e100}), 0);
}

// The solid radius is exact to rounding within a pixel. Farther away it is at least half the
// distance, because each extent is at most twice the one before. Smaller radii would slow down
// sphere tracing.
TEST(HullQueryBall, ExtendsToTheBorderOfAPixel) {
  Silhouette s{{{101, 101, 100, 100, 50, 50}, Eigen::Isometry3d::Identity()},
               ObjectPixels(101, 101)};
  for (int v = 0; v < 101; ++v)
    for (int u = 50; u < 101; ++u) s.pixels.set(u, v);  // the half-space u > 49.5: x = -z / 200
  const test::Queries q(std::vector{s});
  for (const double across_m : {1e-10, 1e-6, 1e-3, 0.05, 0.2}) {
    const Vector3d normal = Vector3d(200, 0, 1).normalized(), on_plane(-1.0 / 200, 0, 1);
    EXPECT_NEAR(q.query.free_radius_m(on_plane - across_m * normal), across_m, 1e-12);
    const double solid_m = q.query.solid_radius_m(on_plane + across_m * normal);
    EXPECT_LE(solid_m, across_m);
    EXPECT_GE(solid_m, across_m < 0.005 ? across_m - 1e-12 : 0.5 * across_m);
  }
  s.camera.camera_from_world.linear() *= 1.0004;  // the same plane with a rotation that stretches
  const test::Queries stretched(std::vector{s});
  const Vector3d inside = Vector3d(-1.0 / 200, 0, 1) + 1e-3 * Vector3d(200, 0, 1).normalized();
  EXPECT_LE(stretched.query.solid_radius_m(inside), 1e-3);
  EXPECT_GE(stretched.query.solid_radius_m(inside), 1e-3 / 1.0005);
}

TEST(HullQueryBall, BehindACameraFreeRadiusIsDistanceToItsPlane) {
  Silhouette s{{{11, 11, 1, 1, 5, 5}, Eigen::Isometry3d::Identity()},
               ObjectPixels(11, 11)};  // so wide that its side planes give small bounds
  for (int v = 0; v < 11; ++v)
    for (int u = 0; u < 11; ++u) s.pixels.set(u, v);
  const test::Queries q(std::vector{s});
  EXPECT_NEAR(q.query.free_radius_m({0, 0, -0.7}), 0.7, 1e-12);
  EXPECT_EQ(q.query.free_radius_m({0, 0, 0}), 0);
}

TEST(HullQueryBall, SphereTracingConvergesToTheEntry) {
  int hits = 0;
  for (int seed = 1; seed <= 10; ++seed) {
    test::Random random(seed);
    const auto silhouettes =
        test::silhouettes_of({test::random_cameras(random, 4), test::random_object(random, 3)});
    const test::Queries q(silhouettes);
    const View view{test::random_camera(random, 30, 20, 0.8), 0.05, 3.0};
    for (int i = 0; i < 600; ++i) {
      const geometry::Ray ray = geometry::ray_through(view.camera, Eigen::Vector2d(i % 30, i / 30));
      const auto entry = q.query.first_entry(ray, view.near_m, view.far_m);
      const double length = ray.direction_world.norm();
      double t = view.near_m;
      for (int step = 0; step < 400 && t < view.far_m; ++step)
        t += q.query.free_radius_m(ray.origin_world_m + t * ray.direction_world) / length;
      EXPECT_LE(t, entry.value_or(kInfinity) + 1e-12);
      if (entry) {
        EXPECT_GT(t, *entry - 0.01);
      }  // sphere tracing converges slowly for grazing rays only
      hits += entry && t > *entry - 1e-6;
    }
  }
  EXPECT_GT(hits, 400);
}

TEST(HullQueryBall, NonOrthonormalRotationKeepsBoundsValid) {
  test::Random random(6);
  auto silhouettes =
      test::silhouettes_of({test::random_cameras(random, 2), test::random_object(random, 3)});
  for (Silhouette& s : silhouettes) s.camera.camera_from_world.linear() *= 1.0004;
  const test::Queries q(silhouettes);
  for (int i = 0; i < 300; ++i) {
    const Vector3d p = test::random_point(random, i);
    test::expect_ball_kept(silhouettes, {}, p, q.query.free_radius_m(p), false, random, 100);
    test::expect_ball_kept(silhouettes, {}, p, q.query.solid_radius_m(p), true, random, 100);
  }
}

// The hull of touched maps contains the object, and no point that a camera sees two pixels beside
// it.
TEST(HullQueryBall, BallsAreCorrectForCapsulesInClosedForm) {
  const std::vector<Capsule> ball{{{0, 0, 0}, {0, 0, 0}, 0.1}};
  std::vector<geometry::Camera> cameras;
  for (const double angle : {0.3, 1.5, 2.9})
    cameras.push_back(
        {geometry::pinhole_from_fov(800, 800, 0.4),
         geometry::look_at(1.5 * Vector3d(std::cos(angle), std::sin(angle), 0.5), {0, 0, 0})});
  const test::Queries q(test::silhouettes_of(ball, cameras));
  const double footprint_m = 1.7 / cameras[0].pinhole.fx_px;
  test::Random random(3);
  EXPECT_GT(q.query.solid_radius_m({0, 0, 0}), 0.05);  // 65 px of 0.9 mm
  for (int i = 0; i < 2000; ++i) {
    const Vector3d p = test::random_in_ball(random, 0.4);
    if (p.norm() < 0.1 - 1e-9) {
      EXPECT_TRUE(q.query.contains(p));
    }
    if (q.query.free_radius_m(p) > 0) {
      EXPECT_GT(p.norm(), 0.1 - 1e-9);
    }
    const double solid_m = q.query.solid_radius_m(p);
    for (int k = 0; k < 10 && solid_m > 2 * footprint_m; ++k)
      EXPECT_TRUE(in_analytic_hull(
          ball, cameras, p + (solid_m - 2 * footprint_m) * test::random_direction(random)));
  }
}

TEST(HullQueryMany, BatchEqualsSingleQueriesForAnyThreadCount) {
  test::Random random(12);
  const auto silhouettes =
      test::silhouettes_of({test::random_cameras(random, 4), test::random_object(random, 3)});
  std::vector<Vector3d> points;
  for (int i = 0; i < 5000; ++i) points.push_back(test::random_point(random, i));
  points[17].x() = test::kNaN;
  for (const HullRule& rule : test::kRules)
    for (const int threads : {1, 2, 5}) {
      base::WorkerPool pool(threads);
      CpuHull hull(pool, silhouettes, rule);
      const HullQuery query(hull);
      std::vector<std::uint8_t> inside(points.size());
      query.contains(points, inside);
      for (std::size_t i = 0; i < points.size(); ++i)
        ASSERT_EQ(inside[i], in_hull(silhouettes, points[i], rule));
      query.contains({}, {});
    }
}

// The last task has between one point and as many as the others.
TEST(HullQueryMany, AnswersEveryPointOfAnyNumber) {
  test::Random random(14);
  const auto silhouettes =
      test::silhouettes_of({test::random_cameras(random, 3), test::random_object(random, 3)});
  for (const HullRule& rule : {HullRule{}, HullRule{Limits::seen, 2}}) {
    const test::Queries q(silhouettes, rule);
    for (const std::size_t count : {1u, 7u, 8u, 255u, 256u, 257u, 511u, 512u, 513u}) {
      std::vector<Vector3d> points;
      for (std::size_t i = 0; i < count; ++i)
        points.push_back(test::random_in_ball(random, i + 1 == count ? 0.1 : 0.3));
      std::vector<std::uint8_t> inside(count, 7);
      q.query.contains(points, inside);
      for (std::size_t i = 0; i < count; ++i)
        ASSERT_EQ(inside[i], in_hull(silhouettes, points[i], rule)) << i << " of " << count;
    }
  }
}

TEST(HullQueryMany, NoPointIsInAnEmptyHull) {
  test::Random random(2);
  auto silhouettes =
      test::silhouettes_of({test::random_cameras(random, 3), test::random_object(random, 2)});
  auto blind = silhouettes, unusable = silhouettes;
  blind[1].pixels = ObjectPixels(160, 121);
  unusable[2].camera.pinhole.cx_px = test::kNaN;
  const std::vector<Vector3d> points(300, Vector3d(0.01, 0.02, 0));
  for (const auto& empty : {std::vector<Silhouette>{}, blind, unusable}) {
    std::vector<std::uint8_t> inside(points.size(), 7);
    test::Queries(empty).query.contains(points, inside);
    EXPECT_EQ(std::count(inside.begin(), inside.end(), 0), 300);
  }
}

// The true hull is unknown, so no ball is known to be free or solid.
TEST(HullQueryBall, HasNoRadiusIfACameraIsNotFinite) {
  test::Random random(3);
  auto silhouettes =
      test::silhouettes_of({test::random_cameras(random, 3), test::random_object(random, 2)});
  silhouettes[2].camera.pinhole.fy_px = test::kNaN;
  for (const HullRule& rule : test::kRules) {
    const test::Queries q(silhouettes, rule);
    for (const Vector3d& p : {Vector3d(0, 0, 0), Vector3d(0, 0, 5), Vector3d(0, -90, 0)}) {
      EXPECT_EQ(q.query.free_radius_m(p), 0);
      EXPECT_EQ(q.query.solid_radius_m(p), 0);
    }
  }
}

TEST(HullQueryMany, ConcurrentQueriesAreSafe) {
  test::Random random(13);
  const auto silhouettes =
      test::silhouettes_of({test::random_cameras(random, 4), test::random_object(random, 3)});
  const test::Queries q(silhouettes);
  std::vector<int> wrong(4, 0);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      test::Random mine(t + 1);
      for (int i = 0; i < 3000; ++i) {
        const Vector3d p = test::random_point(mine, i);
        const bool expected = in_hull(silhouettes, p);
        wrong[std::size_t(t)] +=
            q.query.contains(p) != expected ||
            (expected ? q.query.free_radius_m(p) : q.query.solid_radius_m(p)) > 0;
      }
    });
  for (std::thread& t : threads) t.join();
  EXPECT_EQ(wrong, std::vector<int>(4, 0));
}

}  // namespace
}  // namespace fivepipe::hull
