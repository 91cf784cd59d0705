// Properties that hold for every rig, on seeded random rigs with small maps: each property on 2,000
// rigs (fewer with a sanitizer), with FIVEPIPE_LONG on 10,000. No two properties share a rig.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>

#include "common/hull/query/hull_query.h"
#include "tests/support/hull/scenes.h"
#include "tests/support/sanitizer.h"

namespace fivepipe::hull {
namespace {

using namespace test;
using Eigen::Vector3d;

constexpr int kMaxRigs = 10'000;  // per property; separates the seeds of the properties
int rigs() { return std::getenv("FIVEPIPE_LONG") ? kMaxRigs : 2000 / kSlowdown; }

base::WorkerPool& one_worker() {
  static base::WorkerPool pool(1);  // more threads would not help with maps this small
  return pool;
}

// At most six cameras, near and far, with short and long focal lengths, that see an object or
// noise, with either rule.
struct Rig {
  std::vector<Silhouette> silhouettes;
  HullRule rule;
  View view;
};

Rig random_rig(test::Random& random, int min_cameras = 1) {
  Rig rig;
  const auto object = test::random_object(random, 1 + int(test::uniform(random, 0, 3)));
  const bool noise = test::uniform(random, 0, 1) < 0.3;
  const double filled = test::uniform(random, 0, 1);
  for (int i = int(test::uniform(random, min_cameras - 1, 6)); i >= 0; --i) {
    const int width = 1 + int(test::uniform(random, 0, 40)),
              height = 1 + int(test::uniform(random, 0, 30));
    geometry::Camera camera =
        test::random_camera(random, width, height, std::pow(10.0, test::uniform(random, -0.7, 1)));
    camera.pinhole.fy_px *= test::uniform(random, 0.7, 1.4);
    camera.pinhole.cx_px += test::uniform(random, -5, 5);
    rig.silhouettes.push_back(
        {camera, noise ? test::random_pixels(random, width, height, filled)
                       : true_object_pixels(object, camera, PixelRule::touched)});
  }
  if (test::uniform(random, 0, 1) < 0.5)
    rig.rule = {Limits::seen, 1 + int(test::uniform(random, 0, 3))};
  rig.view = {test::random_camera(random, 12, 9, 0.8), 0.05, 4.0};
  return rig;
}

struct Queries {
  CpuHull hull;
  HullQuery query;
  explicit Queries(const Rig& rig) : hull(one_worker(), rig.silhouettes, rig.rule), query(hull) {}
  std::vector<float> depths(const View& view) {
    return hull.depth(view, test::whole_image(view.camera)).depth_m;
  }
};

Vector3d random_point(test::Random& random) {
  return test::random_in_ball(random, std::pow(10.0, test::uniform(random, -1.5, 0.7)));
}

TEST(HullProperties, FreeAndSolidBallsAreUniform) {
  int free = 0, solid = 0;
  for (int seed = 1; seed <= rigs(); ++seed) {
    test::Random random(seed);
    const Rig rig = random_rig(random);
    const Queries q(rig);
    for (int i = 0; i < 16; ++i) {
      const Vector3d p = random_point(random);
      const double free_m = q.query.free_radius_m(p), solid_m = q.query.solid_radius_m(p);
      ASSERT_FALSE(free_m > 0 && solid_m > 0);
      const double radius_m =
          std::min(std::max(free_m, solid_m), 100.0);  // infinite if there is no hull
      if (!(radius_m > 0)) continue;
      ++(solid_m > 0 ? solid : free);
      for (int k = 0; k < 60; ++k) {
        const double share = k % 3 ? 1 - 1e-12 : std::cbrt(test::uniform(random, 0, 1));
        const Vector3d inside = p + radius_m * share * test::random_direction(random);
        ASSERT_EQ(in_hull(rig.silhouettes, inside, rig.rule), solid_m > 0)
            << "seed " << seed << ", " << (solid_m > 0 ? "solid " : "free ") << radius_m
            << " m around " << p.transpose();
      }
    }
  }
  EXPECT_GT(free, 5 * rigs());
  EXPECT_GT(solid, rigs() / 2);
}

TEST(HullProperties, IsBitIdenticalForEveryCameraOrder) {
  for (int seed = 1; seed <= rigs(); ++seed) {
    test::Random random(kMaxRigs + seed);
    Rig rig = random_rig(random), turned = rig;
    std::shuffle(turned.silhouettes.begin(), turned.silhouettes.end(), random);
    Queries a(rig), b(turned);
    for (int i = 0; i < 10; ++i) {
      const Vector3d p = random_point(random);
      ASSERT_EQ(a.query.contains(p), b.query.contains(p));
      ASSERT_EQ(a.query.free_radius_m(p), b.query.free_radius_m(p));
      ASSERT_EQ(a.query.solid_radius_m(p), b.query.solid_radius_m(p));
      const geometry::Ray ray = segment(p, test::random_in_ball(random, 0.2));
      ASSERT_EQ(a.query.intervals(ray, -1, 2), b.query.intervals(ray, -1, 2));
    }
    ASSERT_EQ(a.depths(rig.view), b.depths(rig.view)) << "seed " << seed;
  }
}

TEST(HullProperties, AnotherCameraNeverAddsVolume) {
  for (int seed = 1; seed <= rigs(); ++seed) {
    test::Random random(2 * kMaxRigs + seed);
    Rig more = random_rig(random, 2);
    more.rule = {};
    Rig fewer = more;
    fewer.silhouettes.pop_back();
    Queries a(fewer), b(more);
    for (int i = 0; i < 20; ++i) {
      const Vector3d p = random_point(random);
      ASSERT_LE(b.query.contains(p), a.query.contains(p));
      ASSERT_GE(b.query.free_radius_m(p), a.query.free_radius_m(p));
      ASSERT_LE(b.query.solid_radius_m(p), a.query.solid_radius_m(p));
    }
    const auto before = a.depths(more.view), after = b.depths(more.view);
    for (std::size_t i = 0; i < after.size(); ++i)
      ASSERT_TRUE(after[i] == kNoHull ||
                  (before[i] != kNoHull && after[i] >= before[i] * (1 - 4e-6f)))
          << "seed " << seed << " ray " << i;
  }
}

geometry::Camera scaled(geometry::Camera camera, double factor) {
  camera.camera_from_world.translation() *= factor;
  return camera;
}

// Scales all lengths. Factors of 2 change no digit. Other factors change the rounding, so a point
// near a pixel's border may move to its other side; the radii are therefore compared with a slack,
// and only if they are not tiny.
TEST(HullProperties, ScalesWithTheUnitOfLength) {
  int compared = 0, hits = 0, moved = 0;
  for (int seed = 1; seed <= rigs(); ++seed) {
    test::Random random(3 * kMaxRigs + seed);
    const Rig rig = random_rig(random);
    const bool power_of_two = seed % 2;
    const double factor = power_of_two ? std::ldexp(1.0, int(test::uniform(random, -6, 7)))
                                       : std::pow(10.0, test::uniform(random, -2, 2));
    Rig other = rig;
    for (Silhouette& s : other.silhouettes) s.camera = scaled(s.camera, factor);
    other.view = {scaled(rig.view.camera, factor), rig.view.near_m * factor,
                  rig.view.far_m * factor};
    Queries a(rig), b(other);
    for (int i = 0; i < 10; ++i) {
      const Vector3d p = random_point(random);
      const double solid_m = a.query.solid_radius_m(p), free_m = a.query.free_radius_m(p),
                   slack_m = power_of_two ? 0 : 1e-9;
      for (const auto& [mine, its] : {std::pair{solid_m, b.query.solid_radius_m(factor * p)},
                                      {free_m, b.query.free_radius_m(factor * p)}}) {
        if (std::isinf(mine)) {
          ASSERT_EQ(mine, its);
        } else {
          ASSERT_NEAR(its, mine * factor, slack_m * factor) << "seed " << seed;
        }
      }
      if (power_of_two) {
        ASSERT_EQ(a.query.contains(p), b.query.contains(factor * p));
      }
      ++compared;
    }
    const auto depths = a.depths(rig.view), its = b.depths(other.view);
    for (std::size_t i = 0; i < depths.size(); ++i) {
      hits += depths[i] != kNoHull;
      if (power_of_two) {
        ASSERT_EQ(its[i], float(depths[i] * factor)) << "seed " << seed << " ray " << i;
      } else
        moved += !(std::abs(its[i] - depths[i] * factor) <= 4e-6 * depths[i] * factor);
    }
  }
  EXPECT_GT(hits, rigs());
  EXPECT_LE(moved, hits / 1000);  // rays that pass a corner of a hull because of rounding
  std::cout << compared << " points, " << hits << " hits, " << moved << " moved\n";
}

TEST(HullProperties, PointsAgreeWithIntervalsAndWithInHull) {
  int inside = 0;
  for (int seed = 1; seed <= rigs(); ++seed) {
    test::Random random(4 * kMaxRigs + seed);
    const Rig rig = random_rig(random);
    const Queries q(rig);
    for (int i = 0; i < 6; ++i) {
      const Vector3d from = random_point(random);
      const geometry::Ray ray = segment(from, test::random_in_ball(random, 0.2));
      const auto found = q.query.intervals(ray, -1, 2);
      for (int k = 0; k < 20; ++k) {
        const double t = test::uniform(random, -1, 2);
        const Vector3d p = ray.origin_world_m + t * ray.direction_world;
        const bool expected = std::any_of(found.begin(), found.end(), [&](const Interval& x) {
          return x.enter <= t && t < x.leave;
        });
        ASSERT_EQ(q.query.contains(p), expected) << "seed " << seed;
        ASSERT_EQ(in_hull(rig.silhouettes, p, rig.rule), expected);
        inside += expected;
      }
    }
  }
  EXPECT_GT(inside, rigs());
}

}  // namespace
}  // namespace fivepipe::hull
