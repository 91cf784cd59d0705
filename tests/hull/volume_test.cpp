// The depth backends and queries of a hull that a box limits, with both rules: rays enter the box
// inside and outside the hull, and the hull continues beyond the box.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/hull/query/hull_query.h"
#include "tests/support/hull/backends.h"

namespace fivepipe::hull {
namespace {

using namespace test;
using Eigen::AlignedBox3d;
using Eigen::Vector3d;

struct BoxedBackend : ForHullBackends {
  DepthTile depth_by(const HullRule& rule, std::span<const Silhouette> silhouettes,
                     const View& view) {
    backend().set(silhouettes, rule);
    return depth_of(backend(), whole_image(view.camera), view);
  }
};
struct ExactBoxedBackend : BoxedBackend {};
INSTANTIATE_TEST_SUITE_P(Hull, BoxedBackend, ::testing::Values("cpu", "gl", "sweep"), backend_name);
INSTANTIATE_TEST_SUITE_P(Hull, ExactBoxedBackend, ::testing::Values("cpu", "gl"), backend_name);

const Capsule kBoxedBall{{0, 0, 0}, {0, 0, 0}, 0.1};

AlignedBox3d random_box(Random& random) {
  const Vector3d center = random_in_ball(random, 0.12);
  const Vector3d half{uniform(random, 0.03, 0.15), uniform(random, 0.03, 0.15),
                      uniform(random, 0.03, 0.15)};
  return {center - half, center + half};
}

HullRule boxed(HullRule rule, const AlignedBox3d& box) {
  rule.within_world_m = box;
  return rule;
}

const HullRule kBothRules[] = {{}, {Limits::seen, 2}};

TEST_P(ExactBoxedBackend, AgreesWithTheReference) {
  int hits = 0, at_a_face = 0, cut = 0;
  for (int seed = 1; seed <= 24; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const auto silhouettes = silhouettes_of({seed % 3 ? random_cameras(random, 1 + seed % 5, 80, 61)
                                                      : narrow_cameras(random, 4, 80, 61),
                                             random_object(random, 4)});
    const View view{random_camera(random, 64, 48, 0.8), 0.05, 5.0};
    for (const HullRule& of_cameras : kBothRules) {
      const HullRule rule = boxed(of_cameras, random_box(random));
      const DepthTile tile = depth_by(rule, silhouettes, view);
      hits += test::expect_reference(tile, silhouettes, view, backend().tolerance(), 3, rule);
      cut += tile.depth_m != depth_by(of_cameras, silhouettes, view).depth_m;
      for (int i = 0; i < int(tile.depth_m.size()); ++i) {
        if (tile.depth_m[std::size_t(i)] == kNoHull) continue;
        const geometry::Ray ray =
            geometry::ray_through(view.camera, Eigen::Vector2d(i % 64, i / 64));
        const Vector3d p =
            ray.origin_world_m + double(tile.depth_m[std::size_t(i)]) * ray.direction_world;
        const double off_m = std::min((p - rule.within_world_m.min()).minCoeff(),
                                      (rule.within_world_m.max() - p).minCoeff());
        EXPECT_GT(off_m, -1e-5);
        at_a_face += std::abs(off_m) < 1e-6;
      }
    }
  }
  EXPECT_GT(hits, 2000);
  EXPECT_GT(at_a_face, 1000);
  EXPECT_GT(cut, 40);
}

// A ray that enters the box inside the hull has the depth of the entry.
TEST_P(ExactBoxedBackend, TheDepthAtAFaceIsThatOfTheEntry) {
  Random random(31);
  const auto silhouettes = silhouettes_of({kBoxedBall}, random_cameras(random, 4));
  // Looks down on the box's top face, which is inside the ball.
  const View view{{geometry::pinhole_from_fov(40, 30, 0.05),
                   geometry::look_at({0.01, 0.02, 0.8}, {0, 0, 0}, Vector3d::UnitX())},
                  0.05,
                  5.0};
  const HullRule rule = boxed({}, {Vector3d(-0.02, -0.02, -0.02), Vector3d(0.02, 0.02, 0.03125)});
  const DepthTile tile = depth_by(rule, silhouettes, view);
  for (int i = 0; i < 40 * 30; ++i) {
    const geometry::Ray ray = geometry::ray_through(view.camera, Eigen::Vector2d(i % 40, i / 40));
    const double entry_m = (0.03125 - ray.origin_world_m.z()) / ray.direction_world.z();
    EXPECT_NEAR(tile.depth_m[std::size_t(i)], entry_m, 1e-7);
  }
}

TEST_P(BoxedBackend, ABoxAroundTheHullChangesNoBit) {
  for (int seed = 1; seed <= 6; ++seed) {
    Random random(seed);
    const auto silhouettes =
        silhouettes_of({random_cameras(random, 4, 80, 61), random_object(random, 3)});
    const View view{random_camera(random, 64, 48, 0.8), 0.05, 5.0};
    // The sweep's view of the box is cut in float.
    const AlignedBox3d box(Vector3d::Constant(-20), Vector3d::Constant(20));
    for (const HullRule& rule : kBothRules)
      EXPECT_EQ(depth_by(boxed(rule, box), silhouettes, view).depth_m,
                depth_by(rule, silhouettes, view).depth_m);
  }
}

TEST_P(BoxedBackend, NothingIsOutsideTheBox) {
  Random random(33);
  const auto silhouettes = silhouettes_of({kBoxedBall}, random_cameras(random, 3, 80, 61));
  const View view{random_camera(random, 64, 48, 0.8), 0.05, 5.0};
  for (const HullRule& rule : kBothRules) {
    EXPECT_FALSE(no_hull(depth_by(rule, silhouettes, view)));
    EXPECT_TRUE(no_hull(
        depth_by(boxed(rule, {Vector3d(0.5, -1, -1), Vector3d(0.6, 1, 1)}), silhouettes, view)));
    // Behind the eye.
    const Vector3d eye = geometry::camera_center_world_m(view.camera);
    EXPECT_TRUE(no_hull(depth_by(
        boxed(rule, {1.5 * eye - Vector3d::Constant(0.1), 1.5 * eye + Vector3d::Constant(0.1)}),
        silhouettes, view)));
  }
}

TEST_P(BoxedBackend, TilesEqualTheWholeViewBitForBit) {
  Random random(34);
  const auto silhouettes =
      silhouettes_of({random_cameras(random, 3, 80, 61), random_object(random, 4)});
  for (const HullRule& of_cameras : kBothRules) {
    const HullRule rule = boxed(of_cameras, random_box(random));
    const View view{random_camera(random, 97, 61, 0.7), 0.05, 5.0};
    const DepthTile whole = depth_by(rule, silhouettes, view);
    const std::vector<PixelRect> parts{{0, 0, 30, 41}, {30, 0, 97, 41}, {0, 41, 97, 61}};
    for (const DepthTile& part : backend().depth(view, parts))
      for (int y = part.rect.v0_px; y < part.rect.v1_px; ++y)
        for (int x = part.rect.u0_px; x < part.rect.u1_px; ++x)
          ASSERT_EQ(
              part.depth_m[(y - part.rect.v0_px) * part.rect.width_px() + x - part.rect.u0_px],
              whole.depth_m[y * 97 + x]);
  }
}

TEST(BoxedSweep, DepthIsThatOfTheFirstPlaneInTheHull) {
  CheckedGlContext context;
  constexpr int kPlanes = 40;
  PlaneSweep sweep(48, 36, kPlanes);
  int hits = 0, same = 0, rays = 0;
  for (int seed = 1; seed <= 8; ++seed) {
    Random random(seed);
    const auto silhouettes =
        silhouettes_of({random_cameras(random, 3, 80, 61), random_object(random, 4)});
    const View view{random_camera(random, 48, 36, 0.8), 0.05, 5.0};
    const SweepRange range{0.2, 1.6};
    for (const HullRule& of_cameras : kBothRules) {
      const HullRule rule = boxed(of_cameras, random_box(random));
      sweep.set_silhouettes(silhouettes, rule);
      const DepthTile tile = depth_of(sweep, whole_image(view.camera), view, range);
      for (int i = 0; i < 48 * 36; ++i, ++rays) {
        const geometry::Ray ray =
            geometry::ray_through(view.camera, Eigen::Vector2d(i % 48, i / 48));
        float expected = kNoHull;
        for (int k = 0; k < kPlanes && expected == kNoHull; ++k) {
          const double t = range.near_m + k * (range.far_m - range.near_m) / kPlanes;
          if (in_hull(silhouettes, ray.origin_world_m + t * ray.direction_world, rule))
            expected = float(t);
        }
        hits += expected != kNoHull;
        same += std::abs(tile.depth_m[std::size_t(i)] - expected) < 1e-5f;
      }
    }
  }
  EXPECT_GT(hits, 500);
  EXPECT_GT(same, rays - rays / 200);
}

TEST(BoxedQuery, AgreesWithInHullAndTheReference) {
  int inside = 0, solid = 0, free_of_box = 0;
  base::WorkerPool pool(2);
  for (int seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const auto silhouettes =
        silhouettes_of({random_cameras(random, 1 + seed % 4, 80, 61), random_object(random, 3)});
    for (const HullRule& of_cameras : kBothRules) {
      const HullRule rule = boxed(of_cameras, random_box(random));
      CpuHull hull(pool, silhouettes, rule);
      const HullQuery query(hull);
      std::vector<Vector3d> points;
      for (int i = 0; i < 300; ++i) {
        points.push_back(random_in_ball(random, 0.25));
        if (i % 7 == 0)  // on a face
          points.back()[i % 3] =
              i % 2 ? rule.within_world_m.min()[i % 3] : rule.within_world_m.max()[i % 3];
      }
      std::vector<std::uint8_t> verdicts(points.size());
      query.contains(points, verdicts);
      for (std::size_t i = 0; i < points.size(); ++i) {
        const Vector3d& p = points[i];
        const bool expected = in_hull(silhouettes, p, rule);
        ASSERT_EQ(query.contains(p), expected);
        ASSERT_EQ(verdicts[i] != 0, expected);
        inside += expected;
        const double free_m = query.free_radius_m(p), solid_m = query.solid_radius_m(p);
        ASSERT_TRUE(free_m == 0 || solid_m == 0);
        solid += solid_m > 0;
        free_of_box += free_m > 0 && in_hull(silhouettes, p, of_cameras);
        for (int k = 0; k < 20; ++k) {
          const Vector3d towards = random_direction(random);
          if (free_m > 0) {
            ASSERT_FALSE(
                in_hull(silhouettes, p + std::min(free_m, 1.0) * (1 - 1e-12) * towards, rule));
          }
          if (solid_m > 0) {
            ASSERT_TRUE(in_hull(silhouettes, p + solid_m * (1 - 1e-12) * towards, rule));
          }
        }
        const geometry::Ray ray{p, random_direction(random)};
        const auto found = query.intervals(ray, 0, 0.5);
        const auto reference = reference_intervals(silhouettes, ray, 0, 0.5, rule);
        double length_m = 0, reference_m = 0;
        for (const Interval& part : found) length_m += part.leave - part.enter;
        for (const Interval& part : reference) reference_m += part.leave - part.enter;
        ASSERT_NEAR(length_m, reference_m, 1e-9);
      }
    }
  }
  EXPECT_GT(inside, 300);
  EXPECT_GT(solid, 200);
  EXPECT_GT(free_of_box, 100);
}

}  // namespace
}  // namespace fivepipe::hull
