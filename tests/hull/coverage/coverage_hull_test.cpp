// The hull of coverage maps, against its definition sampled densely along seeded rays.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/hull/coverage/coverage_walk.h"
#include "tests/support/hull/coverage.h"
#include "tests/support/sanitizer.h"

namespace fivepipe::hull {
namespace {

using namespace test;
using Eigen::Vector2d;
using Eigen::Vector3d;

TEST(TrueCoverage, EqualsManySamples) {
  for (int seed = 1; seed <= std::max(1, 4 / kSlowdown); ++seed) {
    test::Random random(seed);
    const auto object = test::random_object(random, 2);
    const geometry::Camera camera = test::random_camera(random, 40, 31);
    const CoverageMap map = true_coverage(object, camera);
    int partly = 0;
    for (int v = 0; v < 31; ++v)
      for (int u = 0; u < 40; ++u) {
        int in = 0;
        for (int i = 0; i < 60 * 60; ++i)
          in += in_silhouette(object, camera,
                              {u + (i % 60 + 0.5) / 60 - 0.5, v + (i / 60 + 0.5) / 60 - 0.5});
        EXPECT_NEAR(map.at(u, v) / 255.0, in / 3600.0, 0.02 + 1.0 / 60)
            << u << ", " << v;  // including the error of the samples
        partly += in > 0 && in < 3600;
      }
    EXPECT_GT(partly, 10);
  }
}

TEST(CoverageHull, EqualsItsDefinitionOnRandomRigs) {
  Counts counts;
  for (int seed = 1; seed <= 16; ++seed) {
    SCOPED_TRACE(seed);
    test::Random random(seed);
    const auto silhouettes = covered(
        {test::random_cameras(random, 1 + seed % 6, 80, 61), test::random_object(random, 3)});
    const Counts c =
        expect_definition(silhouettes, {test::random_camera(random, 64, 48, 0.8), 0.05, 3.0}, 7);
    counts = {counts.hits + c.hits, counts.between_samples + c.between_samples};
  }
  EXPECT_GT(counts.hits, 500);
  EXPECT_LE(counts.between_samples, counts.hits / 50);
}

TEST(CoverageHull, IsTheSameWithEveryInstructionSet) {
  test::Random random(21);
  const auto silhouettes =
      covered({test::random_cameras(random, 4, 160, 121), test::random_object(random, 3)});
  const View view{test::random_camera(random, 99, 80, 0.8), 0.05, 3.0};
  hwy::SetSupportedTargetsForTest(0);
  const std::int64_t all = hwy::SupportedTargets();
  std::vector<DepthTile> tiles;
  for (std::int64_t left = all; left != 0; left &= left - 1) {
    hwy::SetSupportedTargetsForTest(left & -left);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    tiles.push_back(depth_of(silhouettes, view));
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  for (const DepthTile& tile : tiles) EXPECT_EQ(tile.depth_m, tiles[0].depth_m);
  EXPECT_FALSE(no_hull(tiles[0]));
}

// Every cell differs, and most have saddles and small loops.
TEST(CoverageHull, EqualsItsDefinitionOnNoise) {
  Counts counts;
  for (int seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(seed);
    test::Random random(seed);
    std::vector<CoverageSilhouette> silhouettes;
    for (const geometry::Camera& camera : test::random_cameras(random, 1 + seed % 3, 60, 47))
      silhouettes.push_back(
          {camera, random_map(random, 60, 47, std::vector{0.05, 0.3, 0.6}[seed % 3])});
    const Counts c =
        expect_definition(silhouettes, {test::random_camera(random, 40, 30, 0.9), 0.01, 3.0}, 5);
    counts = {counts.hits + c.hits, counts.between_samples + c.between_samples};
  }
  EXPECT_GT(counts.hits, 1000);
  EXPECT_LE(counts.between_samples, counts.hits / 10);
}

TEST(CoverageHull, PointsBeforeAndBehindADepthAreOutsideAndInside) {
  test::Random random(3);
  const auto silhouettes =
      covered({test::random_cameras(random, 4, 160, 121), test::random_object(random, 3)});
  const View view{test::random_camera(random, 64, 48, 0.8), 0.05, 3.0};
  const DepthTile tile = depth_of(silhouettes, view);
  int hits = 0, thin = 0;
  for (int i = 0; i < 64 * 48; ++i) {
    if (tile.depth_m[i] == kNoHull) continue;
    const geometry::Ray ray = geometry::ray_through(view.camera, Vector2d(i % 64, i / 64));
    EXPECT_FALSE(in_hull(silhouettes,
                         ray.origin_world_m + (tile.depth_m[i] - kAgree_m) * ray.direction_world));
    thin += !in_hull(silhouettes,
                     ray.origin_world_m + (tile.depth_m[i] + kAgree_m) * ray.direction_world);
    ++hits;
  }
  EXPECT_GT(hits, 200);
  EXPECT_LE(thin, hits / 100);
}

TEST(CoverageHull, IsBitIdenticalForEveryCameraOrderThreadCountAndTiling) {
  base::WorkerPool one(1), three(3);
  for (int seed = 1; seed <= 6; ++seed) {
    test::Random random(seed);
    auto silhouettes =
        covered({test::random_cameras(random, 4, 80, 61), test::random_object(random, 3)});
    const View view{test::random_camera(random, 80, 60, 0.8), 0.05, 5.0};
    const SurfaceTile expected = CoverageHull(one, silhouettes).surface(view, {0, 0, 80, 60});
    for (int i = 0; i < 4; ++i) {
      std::shuffle(silhouettes.begin(), silhouettes.end(), random);
      CoverageHull hull(three, silhouettes);
      const SurfaceTile tile = hull.surface(view, {0, 0, 80, 60});
      EXPECT_EQ(tile.depth_m, expected.depth_m);
      EXPECT_EQ(tile.normal_world, expected.normal_world);
      const SurfaceTile part = hull.surface(view, {11, 7, 50, 33});
      for (int v = 7; v < 33; ++v)
        for (int u = 11; u < 50; ++u) {
          ASSERT_EQ(part.depth_m[(v - 7) * 39 + u - 11], expected.depth_m[v * 80 + u]);
          ASSERT_EQ(part.normal_world[(v - 7) * 39 + u - 11], expected.normal_world[v * 80 + u]);
        }
    }
  }
}

TEST(CoverageHull, NormalsAreUnitFaceTheViewAndLieAcrossTheLimitingCamerasSight) {
  test::Random random(4);
  const auto silhouettes =
      covered({test::random_cameras(random, 5, 320, 241), test::random_object(random, 2)});
  const View view{test::random_camera(random, 64, 48, 0.8), 0.05, 5.0};
  const SurfaceTile tile = CoverageHull(test_pool(), silhouettes).surface(view, {0, 0, 64, 48});
  int hits = 0, away = 0;
  for (int i = 0; i < 64 * 48; ++i) {
    EXPECT_EQ(tile.limiting[i] >= 0, tile.normal_world[i].norm() > 0);
    if (tile.limiting[i] < 0) continue;
    ++hits;
    const geometry::Ray ray = geometry::ray_through(view.camera, Vector2d(i % 64, i / 64));
    const Vector3d p = ray.origin_world_m + double(tile.depth_m[i]) * ray.direction_world,
                   normal = tile.normal_world[i].cast<double>();
    const CoverageSilhouette& s = silhouettes[std::size_t(tile.limiting[i])];
    EXPECT_NEAR(normal.norm(), 1, 1e-6);
    EXPECT_NEAR(normal.dot((p - geometry::camera_center_world_m(s.camera)).normalized()), 0,
                1e-5);  // float
    EXPECT_NEAR(min_coverage(std::span(&s, 1), p), 0.5, kOnBorder);
    away += normal.dot(ray.direction_world) > 0;
  }
  EXPECT_GT(hits, 100);
  EXPECT_LE(away,
            hits / 50);  // the fitted plane is not the exact tangent plane, so it may face away
                         // from a ray that grazes
}

// Every hit is in the box, and has the depth of the first sample of the definition in the box. The
// small maps have large cells, so that rays leave the box between the superset's first point and
// the border of the coverage.
TEST(CoverageHull, IsTheDefinitionInsideOfTheBox) {
  test::Random random(9);
  int hits = 0, clipped = 0, left_the_box = 0;
  for (int scene = 0; scene < 12; ++scene) {
    const auto object = test::random_object(random, 3, 0.15);
    std::vector<geometry::Camera> cameras = test::random_cameras(random, 3);
    for (geometry::Camera& camera : cameras)
      camera.pinhole = geometry::pinhole_from_fov(24, 18, 0.8);
    const auto silhouettes = covered(object, cameras);
    const View view{test::random_camera(random, 80, 60, 0.7), 0.05, 3.0};
    HullRule rule;
    for (int axis = 0; axis < 3; ++axis) {
      rule.within_world_m.min()[axis] = -test::uniform(random, 0.02, 0.15);
      rule.within_world_m.max()[axis] = test::uniform(random, 0.02, 0.15);
    }
    const PixelRect whole = test::whole_image(view.camera);
    const auto in_box = CoverageHull(test_pool(), silhouettes, rule).depth(view, whole).depth_m;
    const auto everywhere = CoverageHull(test_pool(), silhouettes).depth(view, whole).depth_m;
    for (int i = 0; i < int(in_box.size()); ++i) {
      const geometry::Ray ray = geometry::ray_through(view.camera, Eigen::Vector2d(i % 80, i / 80));
      const auto at = [&](double t) -> Eigen::Vector3d {
        return ray.origin_world_m + t * ray.direction_world;
      };
      clipped += in_box[i] != everywhere[i];
      if (in_box[i] != kNoHull) {
        ++hits;
        EXPECT_LT(rule.within_world_m.exteriorDistance(at(in_box[i])), 1e-6) << scene << ' ' << i;
        const double inside = std::max(min_coverage(silhouettes, at(in_box[i] + kAgree_m)),
                                       min_coverage(silhouettes, at(in_box[i])));
        EXPECT_GE(inside, 0.5 - kOnBorder) << scene << ' ' << i;
      }
      // No sample of the definition is before the hit.
      const double end_m = in_box[i] == kNoHull ? view.far_m : double(in_box[i]);
      for (double t = view.near_m; t < end_m - kAgree_m; t += 2e-3)
        if (rule.within_world_m.contains(at(t)) && min_coverage(silhouettes, at(t)) > 0.5 + 1e-6)
          ADD_FAILURE() << scene << ' ' << i << " is in the hull at " << t;
      left_the_box += in_box[i] == kNoHull && everywhere[i] != kNoHull;
    }
  }
  EXPECT_GT(hits, 1000);
  EXPECT_GT(clipped, 500);
  EXPECT_GT(left_the_box, 100);
}

// Widths around whole words, and maps of one row or column.
TEST(CellsOfMap, AreThoseOfTheirFourCorners) {
  test::Random random(3);
  for (const int width : {1, 2, 7, 8, 9, 62, 63, 64, 65, 127, 128, 130})
    for (const int height : {1, 2, 5})
      for (const double inside : {0.1, 0.5, 0.9}) {
        const CoverageMap map = random_map(random, width, height, inside);
        const CellsOfMap cells = cells_of(SparseCoverageMap(map).half_covered());
        ASSERT_EQ(cells.any.width_px(), width + 1);
        ASSERT_EQ(cells.all.height_px(), height + 1);
        for (int v = 0; v <= height; ++v)
          for (int u = 0; u <= width; ++u) {
            int covered = 0;
            for (const int dv : {-1, 0})
              for (const int du : {-1, 0})
                covered += map.at(std::clamp(u + du, 0, width - 1),
                                  std::clamp(v + dv, 0, height - 1)) >= 128;
            ASSERT_EQ(cells.any.contains(u, v), covered > 0) << width << ' ' << u << ' ' << v;
            ASSERT_EQ(cells.all.contains(u, v), covered == 4) << width << ' ' << u << ' ' << v;
          }
        // Bits beyond the width would be found.
        EXPECT_LE(cells.any.bounds().u1_px, width + 1);
      }
}

TEST(CoverageMap, ItsOutlineAndObjectPixelsAreTheMap) {
  test::Random random(4);
  for (const int width : {1, 63, 64, 65, 130})
    for (int k = 0; k < 5; ++k) {
      const CoverageMap map = random_map(random, width, 9, 0.4);
      ObjectPixels object(width, 9);
      for (int v = 0; v < 9; ++v)
        for (int u = 0; u < width; ++u) object.set(u, v, test::uniform(random, 0, 1) < 0.5);
      const CoverageOutline outline = map.outline(object);
      EXPECT_EQ(outline.coverage.size(), outline.pixels.count());
      const SparseCoverageMap sparse(object, outline);
      EXPECT_EQ(sparse.dense(), map);
      const ObjectPixels half = sparse.half_covered();
      for (int v = 0; v < 9; ++v)
        for (int u = 0; u < width; ++u) {
          ASSERT_EQ(sparse.at(u, v), map.at(u, v));
          ASSERT_EQ(half.contains(u, v), map.at(u, v) >= 128);
        }
      const CoverageMap binary = CoverageMap::from_pixels(object);
      EXPECT_EQ(binary.outline(object).pixels.count(), 0u);
      CoverageMap kept = map;
      kept.keep(object);
      for (int v = 0; v < 9; ++v)
        for (int u = 0; u < width; ++u)
          ASSERT_EQ(kept.at(u, v), object.contains(u, v) ? map.at(u, v) : 0);
    }
}

}  // namespace
}  // namespace fivepipe::hull
