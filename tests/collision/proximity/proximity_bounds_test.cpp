// Proximity bounds against sampled hulls and the exact reference.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/collision/proximity/lazy_octree.h"
#include "common/hull/oracle/reference.h"
#include "tests/collision/proximity/proximity_queries.h"
#include "tests/support/not_finite.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

TEST(Proximity, AgreesWithAFineGrid) {
  const auto silhouettes = hand();
  const Queries q(silhouettes);
  constexpr double kStep_m = 0.0025;
  std::vector<Vector3d> in;
  for (double x = -0.13; x < 0.12; x += kStep_m)
    for (double y = -0.07; y < 0.07; y += kStep_m)
      for (double z = -0.07; z < 0.07; z += kStep_m)
        if (hull::in_hull(silhouettes, {x, y, z})) in.push_back({x, y, z});
  ASSERT_GT(in.size(), 10'000u);
  Random random(1);
  constexpr collision::ProximityOptions kOptions{0.05, 0.0005};
  const auto points = random_points(random, 300, 0.15);
  const auto found = of_points(q.query, kOptions, points);
  double excess_m = 0;
  int compared = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    double grid_m = kInfinity;
    for (const Vector3d& h : in) grid_m = std::min(grid_m, (h - points[i]).norm());
    ASSERT_LE(found[i].min_m, grid_m);
    if (!(found[i].min_m < kOptions.cap_m)) continue;
    ASSERT_LE(found[i].max_m, grid_m + kOptions.tolerance_m);
    excess_m += grid_m - found[i].max_m;
    ++compared;
  }
  // The nearest grid point is farther than the hull's nearest point. The hand is thicker than the
  // grid step, so the mean difference is at most half a cell's diagonal.
  EXPECT_GT(compared, 100);
  EXPECT_LT(excess_m / compared, 0.5 * std::sqrt(3.0) * kStep_m);
}

// One to five cameras with small maps, of a random object or of noise.
std::vector<hull::Silhouette> random_rig(Random& random, bool noise) {
  const auto object = random_object(random, 1 + int(uniform(random, 0, 3)));
  std::vector<hull::Silhouette> silhouettes;
  for (int i = int(uniform(random, 0, 5)); i >= 0; --i) {
    const int width = 1 + int(uniform(random, 0, 40)), height = 1 + int(uniform(random, 0, 30));
    geometry::Camera camera =
        random_camera(random, width, height, std::pow(10.0, uniform(random, -0.7, 1)));
    camera.pinhole.fy_px *= uniform(random, 0.7, 1.4);
    camera.pinhole.cx_px += uniform(random, -5, 5);
    silhouettes.push_back(
        {camera, noise ? random_pixels(random, width, height, uniform(random, 0, 1))
                       : hull::true_object_pixels(object, camera, hull::PixelRule::touched)});
  }
  return silhouettes;
}

TEST(ProximityCubes, FreeCubesContainNoHullPoint) {
  int free = 0, near = 0;
  for (int seed = 1; seed <= 400; ++seed) {
    Random random(seed);
    const auto silhouettes = random_rig(random, seed % 5 == 0);
    const hull::HullRule rule = kRules[seed % 4];
    const Queries q(silhouettes, rule);
    if (q.hull.empty()) continue;
    const collision::CubeQuery cubes(q.query);
    for (int i = 0; i < 40; ++i) {
      const Vector3d center = random_in_ball(random, i % 2 ? 0.2 : 1.0);
      // The largest free cube, to 1 %: the case in which a wrong bound shows first.
      double half_edge_m = 1;
      while (half_edge_m > 1e-4 && !cubes.test(center, half_edge_m).free) half_edge_m *= 0.99;
      ASSERT_EQ(
          cubes.test(center, half_edge_m).center_in_hull && cubes.test(center, half_edge_m).free,
          false);
      if (!cubes.test(center, half_edge_m).free) continue;
      ++free;
      near += half_edge_m < 0.2;
      for (int k = 0; k < 120; ++k) {
        Vector3d p{uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1)};
        if (k % 3) p /= p.cwiseAbs().maxCoeff();  // on a face
        ASSERT_FALSE(hull::in_hull(silhouettes, center + half_edge_m * p, rule))
            << "seed " << seed << ", " << half_edge_m << " m around " << center.transpose();
      }
    }
  }
  EXPECT_GT(free, 5000);
  EXPECT_GT(near, 2000);
}

// A random box or triangle, and how it moves.
struct SweptBody {
  Vector3d center, half_m;
  collision::Triangle triangle;  // in the box, about the centre
  Vector3d sweep_m;
  bool is_triangle;

  SweptBody(Random& random, int i)
      : center(random_in_ball(random, i % 2 ? 0.2 : 1.0)), is_triangle(i % 3 != 0) {
    for (int axis = 0; axis < 3; ++axis) half_m[axis] = std::pow(10.0, uniform(random, -3, 0));
    for (Vector3d& corner : triangle)
      corner = half_m.cwiseProduct(
          Vector3d{uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1)});
    sweep_m = random_vector(random, 0, 0.3);
  }
  bool is_free(const collision::CubeQuery& cubes, double scale) const {
    const collision::SweptMargin margin{scale * sweep_m, 0};
    if (!is_triangle) return cubes.is_free(center, scale * half_m, margin);
    return cubes.is_free(
        collision::Triangle{center + scale * triangle[0], center + scale * triangle[1],
                            center + scale * triangle[2]},
        margin);
  }
  // Most are on the body's border, at an end of its move.
  Vector3d random_point(Random& random, double scale) const {
    Vector3d p{uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1)};
    if (is_triangle) {
      Vector3d weights{uniform(random, 0, 1), uniform(random, 0, 1), uniform(random, 0, 1)};
      if (uniform(random, 0, 1) < 0.5) weights[int(uniform(random, 0, 2.999))] = 0;
      if (uniform(random, 0, 1) < 0.3) weights = Vector3d::Unit(int(uniform(random, 0, 2.999)));
      weights /= weights.sum();
      p = weights[0] * triangle[0] + weights[1] * triangle[1] + weights[2] * triangle[2];
    } else {
      if (uniform(random, 0, 1) < 0.7) p /= p.cwiseAbs().maxCoeff();
      p = half_m.cwiseProduct(p);
    }
    const double at = uniform(random, -1.5, 1.5);
    return center + scale * (p + std::clamp(at, -1.0, 1.0) * sweep_m);
  }
};

TEST(ProximityCubes, FreeSweptBoxesAndTrianglesContainNoHullPoint) {
  int free[2] = {0, 0}, near = 0;
  for (int seed = 1; seed <= 400; ++seed) {
    Random random(seed);
    const auto silhouettes = random_rig(random, seed % 5 == 0);
    const hull::HullRule rule = kRules[seed % 4];
    const Queries q(silhouettes, rule);
    if (q.hull.empty()) continue;
    const collision::CubeQuery cubes(q.query);
    for (int i = 0; i < 40; ++i) {
      const SweptBody body(random, i);
      // The largest free body of this shape, to 1 %.
      double scale = 1;
      while (scale > 1e-4 && !body.is_free(cubes, scale)) scale *= 0.99;
      if (!body.is_free(cubes, scale)) continue;
      ++free[body.is_triangle];
      near += scale < 1;
      for (int k = 0; k < 120; ++k) {
        const Vector3d p = body.random_point(random, scale);
        ASSERT_FALSE(hull::in_hull(silhouettes, p, rule))
            << "seed " << seed << ", body " << i << " times " << scale << ": " << p.transpose();
      }
    }
  }
  EXPECT_GT(free[0], 1500);
  EXPECT_GT(free[1], 3000);
  EXPECT_GT(near, 1000);
}

// What a body passes is free if a cube around it is, and often if the cube is not. The exceptions
// are cubes that extend behind a camera, and are tested in another way.
TEST(ProximityCubes, SweptBodiesAreFreeIfACubeAroundThemIs) {
  int cube_free = 0, only_body_free = 0, only_cube_free = 0;
  for (int seed = 1; seed <= 200; ++seed) {
    Random random(seed);
    const auto silhouettes = random_rig(random, false);
    const Queries q(silhouettes, kRules[seed % 4]);
    if (q.hull.empty()) continue;
    const collision::CubeQuery cubes(q.query);
    for (int i = 0; i < 100; ++i) {
      const SweptBody body(random, i);
      // A triangle's centre is not that of the box.
      const Vector3d half_m =
          (body.is_triangle ? 2.0 : 1.0) * body.half_m + body.sweep_m.cwiseAbs();
      const bool is_cube_free = cubes.test(body.center, 1.01 * half_m.maxCoeff()).free,
                 is_free = body.is_free(cubes, 1);
      only_cube_free += is_cube_free && !is_free;
      cube_free += is_cube_free;
      only_body_free += is_free && !is_cube_free;
    }
  }
  EXPECT_GT(cube_free, 1000);
  EXPECT_GT(only_body_free, 1000);
  EXPECT_LT(only_cube_free, cube_free / 50);
}

// The other direction of FreeCubesContainNoHullPoint: without an object pixel in the image of a
// slightly larger cube, the cube is certified. The center's verdict is that of in_hull().
TEST(ProximityCubes, CubesBesideTheObjectPixelsAreFreeAndCentersAreExact) {
  int beside = 0, behind = 0, in = 0, out = 0;
  for (int seed = 1; seed <= 300; ++seed) {
    Random random(seed);
    const auto silhouettes = random_rig(random, seed % 5 == 0);
    const hull::HullRule rule = kRules[seed % 4];
    const Queries q(silhouettes, rule);
    // A camera without object pixels gives no hint either.
    if (q.hull.empty() ||
        std::any_of(silhouettes.begin(), silhouettes.end(),
                    [](const hull::Silhouette& s) { return s.pixels.count() == 0; }))
      continue;
    const bool all = rule.limits == hull::Limits::all;
    const collision::CubeQuery cubes(q.query);
    for (int i = 0; i < 60; ++i) {
      const Vector3d center = random_in_ball(random, i % 3 ? 0.15 : 1.0);
      const double half_edge_m = std::pow(10.0, uniform(random, -5, -1.5));
      const collision::CubeVerdict verdict = cubes.test(center, half_edge_m);
      const bool in_hull = hull::in_hull(silhouettes, center, rule);
      // A camera inside the cube gives no hint.
      const bool is_around_a_camera =
          std::any_of(silhouettes.begin(), silhouettes.end(), [&](const hull::Silhouette& s) {
            return std::abs((s.camera.camera_from_world * center).z()) <= 1.8 * half_edge_m;
          });
      if (!is_around_a_camera) {
        ASSERT_EQ(verdict.center_in_hull, in_hull) << "seed " << seed << ' ' << i;
      }
      ++(in_hull ? in : out);
      bool must_be_free = false;
      int may_hold = 0;
      for (const hull::Silhouette& s : silhouettes) {
        const Vector3d p = s.camera.camera_from_world * center;
        const double reach_m = std::sqrt(3.0) * half_edge_m;
        if (p.z() < -1.01 * reach_m) {
          must_be_free |= all, behind += all;
          continue;
        }
        if (p.z() < 20 * reach_m) {  // perspective may enlarge the image by more than a tenth
          ++may_hold;
          continue;
        }
        Eigen::AlignedBox2d image;
        for (int corner = 0; corner < 8; ++corner)
          image.extend(*geometry::project(
              s.camera, center + 1.15 * half_edge_m *
                                     Vector3d(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1,
                                              corner & 4 ? 1 : -1)));
        bool any = false;
        const int width = s.pixels.width_px(), height = s.pixels.height_px();
        for (int v = 0; v < height && !any; ++v)
          for (int u = 0; u < width; ++u)
            any |= s.pixels.contains(u, v) && u + 0.5 >= image.min().x() &&
                   u - 0.5 <= image.max().x() && v + 0.5 >= image.min().y() &&
                   v - 0.5 <= image.max().y();
        const bool sees_all = image.min().x() >= -0.5 && image.min().y() >= -0.5 &&
                              image.max().x() < width - 0.5 && image.max().y() < height - 0.5;
        may_hold += any;
        must_be_free |= !any && (all || sees_all);
      }
      must_be_free |= may_hold < (all ? int(silhouettes.size()) : rule.min_seen);
      if (must_be_free) {
        EXPECT_TRUE(verdict.free) << "seed " << seed << ' ' << i;
        ++beside;
      }
    }
  }
  EXPECT_GT(beside, 3000);
  EXPECT_GT(behind, 100);
  EXPECT_GT(in, 500);
  EXPECT_GT(out, 3000);
}

// Limits::seen: a camera removes the points that it sees, also if it has no object pixel or is
// inside the cube.
TEST(ProximityCubes, CamerasThatGiveNoHintStillRemoveCenters) {
  Random random(12);
  const Vector3d origin = Vector3d::Zero();
  auto silhouettes = silhouettes_of({{origin, origin, 0.3}}, random_cameras(random, 3));
  const hull::HullRule rule{hull::Limits::seen, 3};
  EXPECT_TRUE(
      collision::CubeQuery(Queries(silhouettes, rule).query).test(origin, 1e-3).center_in_hull);
  geometry::Camera camera{geometry::pinhole_from_fov(64, 48, 0.8),
                          geometry::look_at({0, 0, 0.1}, origin, Vector3d::UnitX())};
  silhouettes.push_back({camera, hull::ObjectPixels(64, 48)});
  for (const int pixels : {0, 1}) {
    if (pixels > 0) silhouettes.back().pixels.set(0, 0);
    const Queries q(silhouettes, rule);
    for (const double half_edge_m : {1e-3, 0.15}) {  // the larger one extends behind the camera
      EXPECT_FALSE(hull::in_hull(silhouettes, origin, rule));
      EXPECT_FALSE(collision::CubeQuery(q.query).test(origin, half_edge_m).center_in_hull)
          << pixels << ' ' << half_edge_m;
    }
  }
}

TEST(Proximity, BoundsHoldOnEveryRig) {
  int near = 0, wide = 0;
  for (int seed = 1; seed <= 150; ++seed) {
    Random random(seed);
    const auto silhouettes = random_rig(random, seed % 4 == 0);
    hull::HullRule rule = kRules[seed / 4 % 4];
    if (seed % 3 == 0) {
      const Vector3d corner = random_in_ball(random, 0.2);
      rule.within_world_m = {corner, corner + Vector3d(0.1, 0.2, 0.15)};
    }
    const Queries q(silhouettes, rule);
    const collision::ProximityOptions options{0.2, 0.004};
    const auto points = random_points(random, 12, 0.6);
    const auto found = of_points(q.query, options, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto& [min_m, max_m] = found[i];
      ASSERT_LE(min_m, max_m);
      ASSERT_EQ(max_m == 0, hull::in_hull(silhouettes, points[i], rule)) << "seed " << seed;
      expect_ball_kept(silhouettes, rule, points[i], min_m, false, random, 60);
      // A hull point on any ray is no nearer than min_m.
      const geometry::Ray ray{points[i], random_direction(random)};
      const auto entries = hull::reference_intervals(silhouettes, ray, 0, 0.3, rule);
      ASSERT_LE(min_m, entries.empty() ? kInfinity : entries.front().enter + kRounding_m)
          << "seed " << seed;
      near += max_m > 0 && min_m < options.cap_m;
      wide += !is_tight(found[i], options);
    }
    // Bounds at a finer tolerance overlap these.
    const auto finer = of_points(q.query, {0.2, 0.0005}, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      ASSERT_LE(finer[i].min_m, found[i].max_m + kRounding_m) << "seed " << seed;
      ASSERT_LE(found[i].min_m, finer[i].max_m + kRounding_m) << "seed " << seed;
    }
  }
  EXPECT_GT(near, 200);
  EXPECT_LE(wide, near / 50);  // hulls that end in a needle's point
}

}  // namespace
}  // namespace fivepipe::test
