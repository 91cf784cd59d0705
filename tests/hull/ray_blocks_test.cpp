// Blocks of rays in SIMD, and the cameras and quadrants that backend `cpu` prepares for them.
// ray_margins_test.cpp has the kernels' error bounds.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/hull/cpu/ray_simd.h"
#include "tests/support/hull/scenes.h"

namespace fivepipe::hull {
namespace {

using namespace test;
using Eigen::Vector3d;

base::WorkerPool& test_pool() {
  static base::WorkerPool pool(2);
  return pool;
}

// Tighter or wider margins and other orders of steps change these numbers: the rays that float
// leaves to double, the tiles that may meet the hull, and their distance from it.
TEST(RayBlocks, FloatDecidesNearlyAllRaysOfTilesNearTheHull) {
  int uncertain_rays = 0, prepared = 0, tiles = 0, hits = 0;
  double before_m = 0;
  SimdScratch scratch;
  for (int seed = 1; seed <= 8; ++seed) {
    Random random(seed);
    const auto object = random_object(random, 3);
    CpuHull hull(test_pool(), silhouettes_of(object, random_cameras(random, 4, 640, 480)));
    hull.make_all_quadrants();
    const View view{random_camera(random, 160, 128, 0.8), 0.05, 5.0};
    const DepthTile depth = hull.depth(view, whole_image(view.camera));
    std::vector<MapFromView> maps;
    std::vector<const SkipMap*> skip_maps;
    for (const CpuHull::MapCamera& c : hull.cameras()) {
      maps.push_back(map_from_view(c.camera, view.camera));
      skip_maps.push_back(&c.skip_map);
    }
    for (int v = 0; v < 128; v += kBlock_px)
      for (int u = 0; u < 160; u += kBlock_px) {
        Block block{{u, v, u + kBlock_px, v + kBlock_px}, 0.3, 1.5, false, 0.05, 5.0, {}};
        prepared += prepare(block, maps, skip_maps);
        std::vector<float> found(kRays);
        std::vector<std::uint16_t> uncertain(kRays);
        scratch.tiles.count = scratch.small_tiles.count = 0;
        const int left =
            trace_block(block, maps, skip_maps, scratch, found.data(), kBlock_px, uncertain.data());
        uncertain_rays += left;
        std::vector<bool> decided(kRays, true);
        for (int i = 0; i < left; ++i) decided[uncertain[std::size_t(i)]] = false;
        const auto expected = [&](int i) {
          return depth.depth_m[std::size_t((v + i / kBlock_px) * 160 + u + i % kBlock_px)];
        };
        for (int i = 0; i < kRays; ++i)
          if (decided[std::size_t(i)]) {
            ASSERT_NEAR(found[std::size_t(i)], expected(i), 1e-6) << u << ", " << v << ": " << i;
          }
        const TileSet& small = scratch.small_tiles;
        tiles += small.count;
        for (int t = 0; t < small.count; ++t)
          for (int k = 0; k < 16; ++k) {
            const int i = int(small.center_i[t] - 1.5f) + k % 4,
                      j = int(small.center_j[t] - 1.5f) + k / 4;
            const float hit = expected(j * kBlock_px + i);
            if (hit == kNoHull) continue;
            const double start_m = block.begin + double(small.s[t]);
            ASSERT_GE(hit, start_m * (1 - 1e-5));
            ++hits, before_m += hit - start_m;
          }
      }
  }
  EXPECT_EQ(prepared, 8 * 20);
  // Instruction sets differ in the error of their reciprocals.
  EXPECT_NEAR(uncertain_rays, 585, 15);
  EXPECT_NEAR(tiles, 8546, 4);
  EXPECT_NEAR(hits, 40501, 20);
  EXPECT_NEAR(before_m / hits, 0.0181, 0.0001);
}

Silhouette square(const Vector3d& eye_m, const Vector3d& target_m, int half_px = 30) {
  Silhouette s{
      {geometry::pinhole_from_fov(200, 200, 0.6), geometry::look_at(eye_m, target_m, {0, 0, 1})},
      ObjectPixels(200, 200)};
  for (int v = 100 - half_px; v < 100 + half_px; ++v)
    s.pixels.set_run(100 - half_px, 100 + half_px, v);
  return s;
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
