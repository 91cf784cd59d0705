// Blocks of rays in SIMD, and the cameras and quadrants that backend `cpu` prepares for them.
// ray_margins_test.cpp has the kernels' error bounds.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/hull/cpu/point_simd.h"
#include "common/hull/cpu/ray_simd.h"
#include "tests/support/hull/queries.h"

namespace fivepipe::hull {
namespace {

using namespace test;
using Eigen::Vector3d;

// Tighter or wider margins and other steps change these numbers: the rays that float leaves to
// double, the tiles that may meet the hull, their distance from it, the tests that stop a tile, the
// error of a hit, and how far the cameras' verdicts hold beyond it.
TEST(RayBlocks, FloatDecidesNearlyAllRaysOfTilesNearTheHull) {
  int uncertain_rays = 0, prepared = 0, tiles = 0, hits = 0;
  double before_m = 0, error_m = 0, hold_m = 0;
  int stopped = 0, crossings = 0, holds = 0, both_ways = 0;
  SimdScratch scratch;
  for (int seed = 1; seed <= 8; ++seed) {
    Random random(seed);
    const auto object = random_object(random, 3);
    CpuHull hull(test_pool(),
                 silhouettes_of(object, random_cameras(random, seed > 6 ? 1 : 4, 640, 480)));
    hull.make_all_quadrants();
    View view{random_camera(random, 150, 121, 0.8), 0.05, 5.0};
    if (seed > 6) {  // from behind a camera, so that images move away from its centre
      view.camera.camera_from_world = hull.cameras()[0].camera.camera_from_world;
      view.camera.camera_from_world.translation().z() += 0.2;
      view.near_m = 0.6, view.far_m = 2;
    }
    const DepthTile depth = hull.depth(view, whole_image(view.camera));
    std::vector<MapFromView> maps;
    std::vector<const SkipMap*> skip_maps;
    for (const CpuHull::MapCamera& c : hull.cameras()) {
      maps.push_back(map_from_view(c.camera, view.camera));
      skip_maps.push_back(&c.skip_map);
    }
    for (int v = 0; v < 121; v += kBlock_px)
      for (int u = 0; u < 150; u += kBlock_px) {
        Block block{{u, v, std::min(u + kBlock_px, 150), std::min(v + kBlock_px, 121)},
                    seed > 6 ? view.near_m : 0.3,
                    seed > 6 ? view.far_m : 1.5,
                    seed > 6,
                    view.near_m,
                    view.far_m,
                    {}};
        prepared += prepare(block, maps, skip_maps);
        for (const BlockCamera& c : block.cameras) both_ways += c.both_ways;
        std::vector<float> found(kRays);
        std::vector<std::uint16_t> uncertain(kRays);
        scratch.tiles.count = scratch.small_tiles.count = 0;
        const int left =
            trace_block(block, maps, skip_maps, scratch, found.data(), kBlock_px, uncertain.data());
        uncertain_rays += left;
        std::vector<bool> decided(kRays, true);
        for (int i = 0; i < left; ++i) decided[uncertain[std::size_t(i)]] = false;
        const auto expected = [&](int i) {
          return depth.depth_m[std::size_t((v + i / kBlock_px) * 150 + u + i % kBlock_px)];
        };
        for (int i = 0; i < kRays; ++i)
          if (i % kBlock_px < block.rays.width_px() && i / kBlock_px < block.rays.height_px() &&
              decided[std::size_t(i)]) {
            ASSERT_NEAR(found[std::size_t(i)], expected(i), 1e-6) << u << ", " << v << ": " << i;
          }
        const TileSet& small = scratch.small_tiles;
        tiles += small.count;
        for (std::size_t c = 0; c < maps.size(); ++c)
          stopped += scratch.tiles.stopped[c] + small.stopped[c];
        for (int t = 0; t < small.count; ++t)
          for (int k = 0; k < 16; ++k) {
            const int i = int(small.center_i[t] - 1.5f) + k % 4,
                      j = int(small.center_j[t] - 1.5f) + k / 4;
            if (i >= block.rays.width_px() || j >= block.rays.height_px()) continue;
            const float hit = expected(j * kBlock_px + i);
            if (hit == kNoHull || !decided[std::size_t(j * kBlock_px + i)]) continue;
            const std::size_t ray = std::size_t(16 * t + k);
            ASSERT_NEAR(block.begin + double(scratch.s[ray]), hit, 1e-5);
            crossings += scratch.crossed[ray] >= 0;
            error_m += double(scratch.s_error[ray]);
            for (std::size_t c = 0; c < maps.size(); ++c)
              if (const float hold = scratch.hold[c][ray]; hold < 1) {
                ++holds, hold_m += double(hold - scratch.s[ray]);
              }
            const double start_m = block.begin + double(small.s[t]);
            ASSERT_GE(hit, start_m * (1 - 1e-5));
            ++hits, before_m += hit - start_m;
          }
      }
  }
  EXPECT_EQ(prepared, 8 * 20);
  EXPECT_GE(both_ways, 80);
  // Instruction sets differ in the error of their reciprocals.
  EXPECT_NEAR(uncertain_rays, 1364, 20);
  EXPECT_NEAR(tiles, 6529, 4);
  EXPECT_NEAR(hits, 34309, 20);
  EXPECT_NEAR(crossings, 33706, 20);
  EXPECT_NEAR(stopped, 34289, 10);
  EXPECT_NEAR(holds, 133016, 80);
  EXPECT_NEAR(before_m / hits, 0.024426, 2e-5);
  EXPECT_NEAR(error_m / hits, 2.106e-6, 0.02e-6);
  EXPECT_NEAR(hold_m / holds, 0.048347, 2e-5);
}

Silhouette square(const Vector3d& eye_m, const Vector3d& target_m, int half_px = 30) {
  Silhouette s{
      {geometry::pinhole_from_fov(200, 200, 0.6), geometry::look_at(eye_m, target_m, {0, 0, 1})},
      ObjectPixels(200, 200)};
  for (int v = 100 - half_px; v < 100 + half_px; ++v)
    s.pixels.set_run(100 - half_px, 100 + half_px, v);
  return s;
}

// Points away from all pixel borders are decided, and as in_hull() does.
TEST(PointsInSimd, AreDecidedAwayFromPixelBorders) {
  int inside = 0;
  for (int seed = 1; seed <= 6; ++seed) {
    Random random(seed);
    auto silhouettes =
        silhouettes_of({random_cameras(random, 1 + seed % 4), random_object(random, 3)});
    if (seed % 2)
      for (Silhouette& s : silhouettes) s.pixels = random_pixels(random, 160, 121, 0.6);
    CpuHull hull(test_pool(), silhouettes);
    hull.make_all_quadrants();
    std::vector<Vector3d> points;
    for (int i = 0; i < 2048; ++i)
      points.push_back(random_in_ball(random, i % 3 == 0 ? 0.1 : i % 3 == 1 ? 0.5 : 4.0));
    std::vector<InHull> verdicts(points.size());
    contains_simd(point_simd_cameras(hull), points, verdicts.data());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const bool expected = in_hull(silhouettes, points[i]);
      ASSERT_EQ(verdicts[i], expected ? InHull::yes : InHull::no);
      inside += expected;
    }
  }
  EXPECT_GT(inside, 500);
}

// A camera at the origin that looks along z. The bound of a pixel's error is twice that of the
// point's, times the focal length, plus that of the pixel itself, for 32 roundings of one epsilon.
TEST(PointsInSimd, AreUncertainWithinTheBoundOfRounding) {
  Silhouette s{{{200, 100, 150, 80, 99.5, 40.25}, Eigen::Isometry3d::Identity()},
               ObjectPixels(200, 100)};
  s.camera.camera_from_world.translation() = Vector3d(0.5, -0.25, 1);
  for (int v = 0; v < 100; ++v) s.pixels.set_run(0, 200, v);
  CpuHull hull(test_pool(), std::vector{s});
  hull.make_all_quadrants();
  const auto cameras = point_simd_cameras(hull);
  const double unit = 32 * std::numeric_limits<double>::epsilon();
  Random random(4);
  for (int i = 0; i < 200; ++i) {
    const double z = uniform(random, 0.5, 4);
    const int axis = i % 2;
    const double border = std::floor(uniform(random, 20, 80)) + 0.5,
                 other = std::floor(uniform(random, 20, 80)) + 0.2;
    const geometry::Pinhole& k = s.camera.pinhole;
    const double focal = axis ? k.fy_px : k.fx_px, principal = axis ? k.cy_px : k.cx_px;
    const double slope = (border - principal) / focal;
    Vector3d p((axis ? other - k.cx_px : border - k.cx_px) / k.fx_px * z,
               (axis ? border - k.cy_px : other - k.cy_px) / k.fy_px * z, z);
    const Vector3d at = p - Vector3d(0.5, -0.25, 1);
    const double rounding_m = unit * (at.cwiseAbs().sum() + 1.75),
                 bound_px = 2 * focal * (1 + std::abs(slope)) * rounding_m / z +
                            unit * (border + 0.5 + 1 + principal + 0.5);
    for (const double factor : {-1.5, -0.7, 0.7, 1.5}) {
      Vector3d moved = at;
      moved[axis] += factor * bound_px / focal * z;
      const std::vector<Vector3d> points(16, moved);
      std::vector<InHull> verdicts(16);
      contains_simd(cameras, points, verdicts.data());
      for (const InHull verdict : verdicts)
        ASSERT_EQ(verdict, std::abs(factor) < 1 ? InHull::uncertain : InHull::yes)
            << i << ": " << factor;
    }
  }
}

// The last points that fill no vector are left to double.
TEST(PointsInSimd, LeaveTheRestOfAVectorToDouble) {
  CpuHull hull(test_pool(), std::vector{square({0, -2, 0}, {0, 0, 0})});
  hull.make_all_quadrants();
  for (const std::size_t count : {0u, 1u, 7u, 8u, 9u, 17u}) {
    const std::vector<Vector3d> points(count, Vector3d(0.001, 0, 0.001));
    std::vector<InHull> verdicts(count, InHull::no);
    contains_simd(point_simd_cameras(hull), points, verdicts.data());
    for (std::size_t i = 0; i < count; ++i) {
      if (i < count / 8 * 8) {
        EXPECT_EQ(verdicts[i], InHull::yes);
      } else {
        EXPECT_NE(verdicts[i], InHull::no);
      }
    }
  }
}

// The rays of a view from the camera's left move to the right in its image, and so on.
TEST(CpuHull, CreatesOnlyTheQuadrantsIntoWhichTheRaysMove) {
  const Vector3d eye(0, -2, 0);  // looks along y; x is to the right, z up
  for (const bool left : {false, true})
    for (const bool up : {false, true}) {
      CpuHull hull(test_pool(), std::vector{square(eye, {0, 0, 0})});
      const View view{{geometry::pinhole_from_fov(64, 48, 0.4),
                       geometry::look_at({left ? 0.5 : -0.5, -2, up ? -0.5 : 0.5}, {0, 0, 0})},
                      0.1,
                      4};
      hull.depth(view, whole_image(view.camera));
      for (int box = 0; box < kQuadrants; ++box)
        EXPECT_EQ(hull.cameras()[0].skip_map.has(Quadrant(box)),
                  Quadrant(box) == quadrant_ahead(left, up))
            << left << up << box;
    }
  // From behind the camera, the images move away from its centre or towards it.
  CpuHull hull(test_pool(), std::vector{square(eye, {0, 0, 0})});
  const View view{
      {geometry::pinhole_from_fov(64, 48, 0.6), geometry::look_at({0, -2.5, 0}, {0, 0, 0})},
      0.1,
      4};
  hull.depth(view, whole_image(view.camera));
  for (int box = 0; box < kQuadrants; ++box)
    EXPECT_TRUE(hull.cameras()[0].skip_map.has(Quadrant(box)));
}

// The view is behind the camera, so images move towards its centre. The object is in the lower
// right quarter of the image. Blocks of rays in the other quarters pass its bounds before they are
// in front of the camera.
TEST(CpuHull, CreatesNoQuadrantForBlocksThatMissTheHull) {
  Silhouette s = square({0, -2, 0}, {0, 0, 0}, 0);
  for (int v = 130; v < 190; ++v) s.pixels.set_run(130, 190, v);
  CpuHull hull(test_pool(), std::vector{s});
  const View view{
      {geometry::pinhole_from_fov(128, 128, 0.6), geometry::look_at({0, -2.5, 0}, {0, 0, 0})},
      0.1,
      4};
  const DepthTile tile = hull.depth(view, whole_image(view.camera));
  EXPECT_GT(
      std::count_if(tile.depth_m.begin(), tile.depth_m.end(), [](float d) { return d != kNoHull; }),
      1000);
  for (int box = 0; box < kQuadrants; ++box)
    EXPECT_EQ(hull.cameras()[0].skip_map.has(Quadrant(box)), Quadrant(box) == Quadrant::left_up)
        << box;
}

// The kernels use all quadrants if images move both ways along one axis.
TEST(CpuHull, CreatesAllQuadrantsIfImagesMoveBothWaysAlongAnAxis) {
  for (const Vector3d& eye : {Vector3d(0, -2.5, 0), Vector3d(0, -2.5, 0.2), Vector3d(0, -2.5, -0.2),
                              Vector3d(0.2, -2.5, 0), Vector3d(-0.2, -2.5, 0)}) {
    CpuHull hull(test_pool(), std::vector{square({0, -2, 0}, {0, 0, 0}, 80)});
    const View view{{geometry::pinhole_from_fov(128, 128, 0.4),
                     geometry::look_at(eye, eye + Vector3d(0, 1, 0))},
                    0.1,
                    4};
    hull.depth(view, whole_image(view.camera));
    for (int box = 0; box < kQuadrants; ++box)
      EXPECT_TRUE(hull.cameras()[0].skip_map.has(Quadrant(box))) << eye.transpose() << ": " << box;
  }
}

TEST(CpuHull, CreatesNoQuadrantForAViewThatMissesTheHull) {
  CpuHull hull(test_pool(), std::vector{square({0, -2, 0}, {0, 0, 0})});
  const View view{
      {geometry::pinhole_from_fov(64, 48, 0.4), geometry::look_at({0.5, -2, 0}, {3, -2, 1})},
      0.1,
      4};
  hull.depth(view, whole_image(view.camera));
  for (int box = 0; box < kQuadrants; ++box)
    EXPECT_FALSE(hull.cameras()[0].skip_map.has(Quadrant(box)));
  hull.make_all_quadrants();
  for (int box = 0; box < kQuadrants; ++box)
    EXPECT_TRUE(hull.cameras()[0].skip_map.has(Quadrant(box)));
}

// The camera with the smallest object is tested first. Equal ones have an order of their own.
TEST(CpuHull, SortsCamerasByTheirObjectsAndNotByTheGivenOrder) {
  std::vector<Silhouette> silhouettes;
  for (const int half_px : {40, 10, 25, 10})
    silhouettes.push_back(square({0, -2, 0}, {0, 0, 0}, half_px));
  for (const double x : {0.5, 0.3, -0.4}) silhouettes.push_back(square({x, -2, 0}, {0, 0, 0}, 25));
  silhouettes.push_back(square({0, -2, 0}, {0, 0, 0}, 25));
  silhouettes.back().pixels.set(100, 100, false);
  const auto in_order = [&](const std::vector<Silhouette>& given) {
    const CpuHull hull(test_pool(), given);
    std::vector<const Silhouette*> order;
    for (const CpuHull::MapCamera& c : hull.cameras()) {
      const Silhouette& s = given[std::size_t(c.silhouette)];
      EXPECT_EQ(c.camera.camera_from_world.matrix(), s.camera.camera_from_world.matrix());
      EXPECT_EQ(c.skip_map.bounds(), s.pixels.bounds());
      order.push_back(&s);
    }
    return order;
  };
  const auto once = in_order(silhouettes);
  for (std::size_t i = 1; i < once.size(); ++i)
    EXPECT_LE(once[i - 1]->pixels.bounds().area_px(), once[i]->pixels.bounds().area_px());
  Random random(1);
  for (int round = 0; round < 10; ++round) {
    auto given = silhouettes;
    std::shuffle(given.begin(), given.end(), random);
    const auto again = in_order(given);
    ASSERT_EQ(again.size(), once.size());
    for (std::size_t i = 0; i < once.size(); ++i) {
      EXPECT_EQ(again[i]->camera.camera_from_world.matrix(),
                once[i]->camera.camera_from_world.matrix());
      EXPECT_EQ(again[i]->pixels, once[i]->pixels);
    }
  }
}

TEST(CpuHull, StateIsThatOfTheLastAssign) {
  const auto good = std::vector{square({0, -2, 0}, {0, 0, 0}), square({2, 0, 0}, {0, 0, 0})};
  auto not_finite = good, blind = good;
  not_finite[1].camera.pinhole.cx_px = NAN;
  blind[0].pixels = ObjectPixels(200, 200);
  CpuHull hull(test_pool());
  const auto expect = [&](bool empty, bool unusable, std::size_t cameras) {
    EXPECT_EQ(hull.empty(), empty);
    EXPECT_EQ(hull.unusable(), unusable);
    EXPECT_EQ(hull.cameras().size(), cameras);
  };
  expect(true, false, 0);
  for (int round = 0; round < 2; ++round) {
    hull.assign(good);
    expect(false, false, 2);
    EXPECT_EQ(hull.rule().limits, Limits::all);
    hull.assign(not_finite);
    expect(true, true, 0);
    hull.assign(std::span(good).first(1), {Limits::seen, 1});
    expect(false, false, 1);
    EXPECT_EQ(hull.rule().limits, Limits::seen);
    hull.assign(blind);
    expect(true, false, 2);
    hull.assign(blind, {Limits::seen, 2});
    expect(false, false, 2);
    hull.assign({});
    expect(true, false, 0);
  }
}

}  // namespace
}  // namespace fivepipe::hull
