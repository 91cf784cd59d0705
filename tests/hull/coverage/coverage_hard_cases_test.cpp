// Hard cases of the hull of coverage maps.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/hull/coverage.h"

namespace fivepipe::hull {
namespace {

using namespace test;
using Eigen::Vector2d;
using Eigen::Vector3d;

// Two cameras at right angles, 2 m from the origin, and a view from a third side.
struct CoverageSquare : ::testing::Test {
  std::vector<CoverageSilhouette> silhouettes;
  View view{
      {geometry::pinhole_from_fov(64, 48, 0.5), geometry::look_at({-0.3, -2, 0.4}, {0, 0, 0})},
      0.05,
      5.0};
  CoverageSquare() {
    for (const Vector3d& eye : {Vector3d(2, 0, 0), Vector3d(0, 2, 0)})
      silhouettes.push_back(
          {{geometry::pinhole_from_fov(100, 75, 0.5), geometry::look_at(eye, {0, 0, 0})},
           CoverageMap(100, 75)});
  }
  void fill(int camera, const PixelRect& r, std::uint8_t coverage = 255) {
    CoverageMap map = silhouettes[camera].map.dense();
    for (int v = r.v0_px; v < r.v1_px; ++v)
      for (int u = r.u0_px; u < r.u1_px; ++u) map.set(u, v, coverage);
    silhouettes[camera].map = map;
  }
  // The pixels at or above one half, as binary maps.
  std::vector<Silhouette> binary() const {
    std::vector<Silhouette> maps;
    for (const CoverageSilhouette& s : silhouettes) {
      ObjectPixels pixels(s.map.width_px(), s.map.height_px());
      for (int v = 0; v < pixels.height_px(); ++v)
        for (int u = 0; u < pixels.width_px(); ++u) pixels.set(u, v, s.map.at(u, v) >= 128);
      maps.push_back({s.camera, pixels});
    }
    return maps;
  }
};

TEST_F(CoverageSquare, NothingCoveredInOneCameraHasNoHull) {
  fill(0, {30, 30, 60, 50});
  EXPECT_TRUE(no_hull(depth_of(silhouettes, view)));
}
TEST_F(CoverageSquare, CoverageJustBelowOneHalfHasNoHull) {
  fill(0, {30, 30, 60, 50});
  fill(1, {0, 0, 100, 75}, 127);
  EXPECT_TRUE(no_hull(depth_of(silhouettes, view)));
  fill(1, {0, 0, 100, 75}, 128);
  EXPECT_FALSE(no_hull(depth_of(silhouettes, view)));
}
TEST_F(CoverageSquare, NoCameraHasNoHull) { EXPECT_TRUE(no_hull(depth_of({}, view))); }
// The images' borders limit the hull.
TEST_F(CoverageSquare, AllCoveredIsTheHullOfAllPixels) {
  fill(0, {0, 0, 100, 75});
  fill(1, {0, 0, 100, 75});
  const DepthTile tile = depth_of(silhouettes, view),
                  expected =
                      CpuHull(test_pool(), binary()).depth(view, test::whole_image(view.camera));
  for (std::size_t i = 0; i < tile.depth_m.size(); ++i)
    EXPECT_NEAR(tile.depth_m[i], expected.depth_m[i], kAgree_m);
  EXPECT_GT(expect_definition(silhouettes, view, 3).hits, 200);
  const SurfaceTile surface =
      CoverageHull(test_pool(), silhouettes).surface(view, test::whole_image(view.camera));
  for (const Eigen::Vector3f& normal : surface.normal_world) EXPECT_EQ(normal.norm(), 0);
}
// The coverage falls across the images, but stays above one half: only the images' borders limit
// the hull.
TEST_F(CoverageSquare, ImageBordersHaveNoNormalAlthoughTheCoverageFalls) {
  for (int v = 0; v < 75; ++v)
    for (const int camera : {0, 1})
      fill(camera, {0, v, 100, v + 1}, std::uint8_t(128 + (camera ? v : 74 - v) * 127 / 74));
  ASSERT_TRUE(outward_in_image(silhouettes[0].map, {0, 37}));
  const SurfaceTile tile =
      CoverageHull(test_pool(), silhouettes).surface(view, test::whole_image(view.camera));
  EXPECT_FALSE(no_hull({tile.rect, tile.depth_m}));
  for (std::size_t i = 0; i < tile.depth_m.size(); ++i) {
    ASSERT_EQ(tile.limiting[i], -1) << i;
    ASSERT_EQ(tile.normal_world[i].norm(), 0) << i;
  }
}
// The border is half way from an object pixel's centre to the next centre.
TEST_F(CoverageSquare, StraightBordersOfBinaryMapsAreThePixels) {
  fill(0, {30, 0, 60, 75});
  fill(1, {20, 0, 80, 75});
  const DepthTile tile = depth_of(silhouettes, view),
                  expected =
                      CpuHull(test_pool(), binary()).depth(view, test::whole_image(view.camera));
  for (std::size_t i = 0; i < tile.depth_m.size(); ++i)
    EXPECT_NEAR(tile.depth_m[i], expected.depth_m[i], kAgree_m);
  EXPECT_FALSE(no_hull(tile));
}
// Between coverage 255 and c the border is at (255 - 127.5) / (255 - c) px.
TEST_F(CoverageSquare, StraightBordersBetweenPixelsFollowTheCoverage) {
  fill(0, {0, 0, 100, 75});
  fill(1, {0, 0, 100, 75});
  fill(1, {0, 0, 40, 75}, 0);
  fill(1, {40, 0, 41, 75}, 55);  // level at 127.5 / 200 px before pixel 41's centre
  view.camera.camera_from_world = geometry::look_at({3, 0, 0}, {0, 0, 0});
  const double border_u = 41 - 127.5 / 200;
  const geometry::Camera& camera =
      silhouettes[1].camera;  // at (0, 2, 0), looking along -y; x runs along u
  const double border_x =
      geometry::ray_through(camera, {border_u, 37}).direction_world.x();  // per metre of depth
  int checked = 0;
  const DepthTile tile = depth_of(silhouettes, view);
  for (int i = 0; i < 64 * 48; ++i) {
    if (tile.depth_m[i] == kNoHull) continue;
    const geometry::Ray ray = geometry::ray_through(view.camera, Vector2d(i % 64, i / 64));
    const Vector3d p = ray.origin_world_m + double(tile.depth_m[i]) * ray.direction_world;
    if (min_coverage(std::span(silhouettes).subspan(1, 1), p) > 0.51) continue;
    EXPECT_NEAR(p.x(), border_x * (2 - p.y()), 1e-6);
    ++checked;
  }
  EXPECT_GT(checked, 20);
}
TEST_F(CoverageSquare, BinaryMapsEqualTheDefinition) {
  test::Random random(6);
  for (int i = 0; i < 2; ++i)
    silhouettes[i].map = CoverageMap::from_pixels(test::random_pixels(random, 100, 75, 0.4));
  EXPECT_GT(expect_definition(silhouettes, view, 11).hits, 50);
}
// Two cameras have one pose and border, but different coverage beside it and so different normals.
TEST_F(CoverageSquare, TiesBetweenLimitingCamerasAreIndependentOfOrder) {
  silhouettes.push_back(silhouettes[0]);
  fill(0, {30, 30, 60, 50});
  fill(1, {0, 0, 100, 75});
  fill(2, {30, 30, 60, 50});
  for (const int v : {32, 37, 41}) fill(2, {60, v, 62, v + 2}, 120);
  for (const int v : {33, 38, 42}) fill(2, {28, v, 29, v + 2}, 120);
  const SurfaceTile expected =
      CoverageHull(test_pool(), silhouettes).surface(view, test::whole_image(view.camera));
  std::swap(silhouettes[0], silhouettes[2]);
  const SurfaceTile swapped =
      CoverageHull(test_pool(), silhouettes).surface(view, test::whole_image(view.camera));
  EXPECT_EQ(swapped.depth_m, expected.depth_m);
  EXPECT_EQ(swapped.normal_world, expected.normal_world);
}
TEST_F(CoverageSquare, MapOfSizeZeroHasNoHull) {
  silhouettes[0].map = CoverageMap(0, 0);
  fill(1, {0, 0, 100, 75});
  EXPECT_TRUE(no_hull(depth_of(silhouettes, view)));
  EXPECT_EQ(silhouettes[0].map.interpolated(0, 0), 0);
}
// The coverage is clamped on all sides, so the pixel's square is in or out as a whole.
TEST_F(CoverageSquare, MapOfOnePixelIsItsSquare) {
  silhouettes[0] = {
      {geometry::pinhole_from_fov(1, 1, 0.2), silhouettes[0].camera.camera_from_world},
      CoverageMap(1, 1)};
  fill(0, {0, 0, 1, 1}, 128);
  fill(1, {20, 20, 70, 60});
  EXPECT_GT(expect_definition(silhouettes, view, 3).hits, 20);
  fill(0, {0, 0, 1, 1}, 127);
  EXPECT_TRUE(no_hull(depth_of(silhouettes, view)));
}
TEST_F(CoverageSquare, OneRowOrColumnEqualsTheDefinition) {
  for (const auto& [width, height] : {std::pair(40, 1), {1, 40}}) {
    test::Random random(9);
    geometry::Pinhole pinhole = geometry::pinhole_from_fov(width, height, 0.5);
    pinhole.fx_px = pinhole.fy_px = 80;
    silhouettes[0] = {{pinhole, silhouettes[0].camera.camera_from_world},
                      random_map(random, width, height, 0.6)};
    fill(1, {10, 10, 90, 70});
    expect_definition(silhouettes, view, 3);
  }
}
TEST_F(CoverageSquare, ObjectCutByTheImageBorderEqualsTheDefinition) {
  fill(0, {80, 0, 100, 40}, 200);
  fill(1, {40, 0, 100, 75}, 180);
  expect_definition(silhouettes, view, 3);
}
TEST_F(CoverageSquare, OutsideEveryImageAndForNaNNothingIsCovered) {
  fill(0, {0, 0, 100, 75});
  const SparseCoverageMap& map = silhouettes[0].map;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(map.interpolated(-0.5, -0.5), 1);
  for (const auto& [u, v] :
       {std::pair(-0.51, 0.0), {99.5, 0.0}, {0.0, 74.5}, {0.0, -0.51}, {nan, 0.0}, {0.0, nan}})
    EXPECT_EQ(map.interpolated(u, v), 0);
  EXPECT_FALSE(in_hull(silhouettes, {nan, 0, 0}));
  EXPECT_FALSE(in_hull(std::span<const CoverageSilhouette>(), Vector3d::Zero()));
  EXPECT_FALSE(outward_in_image(map, {50, 37}));  // equal on all sides
  EXPECT_FALSE(outward_in_image(map, {nan, 37}));
  EXPECT_FALSE(outward_in_image(CoverageMap(), {0, 0}));
}
TEST_F(CoverageSquare, NotANumberInACalibrationHasNoHull) {
  fill(0, {0, 0, 100, 75});
  fill(1, {0, 0, 100, 75});
  const auto good = silhouettes;
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    for (double geometry::Pinhole::*field :
         {&geometry::Pinhole::fx_px, &geometry::Pinhole::cy_px}) {
      silhouettes = good;
      silhouettes[1].camera.pinhole.*field = bad;
      EXPECT_TRUE(no_hull(depth_of(silhouettes, view)));
    }
    silhouettes = good;
    silhouettes[0].camera.camera_from_world.translation().y() = bad;
    EXPECT_TRUE(no_hull(depth_of(silhouettes, view)));
    View bad_view = view;
    bad_view.camera.camera_from_world.linear()(1, 1) = bad;
    EXPECT_TRUE(no_hull(depth_of(good, bad_view)));
    bad_view = view;
    bad_view.far_m = bad;
    EXPECT_TRUE(no_hull(depth_of(good, bad_view)));
  }
}

TEST_F(CoverageSquare, EyeInsideTheHullSeesTheNearPlane) {
  fill(0, {10, 10, 90, 70});
  fill(1, {10, 10, 90, 70});
  view.camera.camera_from_world = geometry::look_at({0.01, 0, 0.02}, {1, 1, 0});
  const SurfaceTile tile =
      CoverageHull(test_pool(), silhouettes).surface(view, test::whole_image(view.camera));
  for (const float d : tile.depth_m) EXPECT_EQ(d, float(view.near_m));
  for (const std::int16_t camera : tile.limiting) EXPECT_EQ(camera, -1);
}
// The image of such a ray does not move, or the ray starts behind the camera.
TEST_F(CoverageSquare, RayThroughACameraCentreAndCameraInTheViewEqualTheDefinition) {
  fill(0, {10, 10, 90, 70}, 220);
  fill(1, {10, 10, 90, 70}, 190);
  for (const Vector3d& eye : {Vector3d(3, 0, 0), Vector3d(2, 0, 0), Vector3d(3, 0.25, 0.125)}) {
    view.camera.camera_from_world =
        geometry::look_at(eye, eye.y() == 0 ? Vector3d(0, 0, 0) : Vector3d(2, 0, 0));
    view.camera.pinhole = {65, 49, 100, 100, 32, 24};
    EXPECT_GT(expect_definition(silhouettes, view, 5).hits, 50);
  }
}
// The view shares a camera's axes, so images run along rows, on centres and between them.
TEST_F(CoverageSquare, RaysAlongCellBordersEqualTheDefinition) {
  test::Random random(5);
  silhouettes[0].map = random_map(random, 100, 75, 0.5);
  fill(1, {20, 20, 80, 60});
  silhouettes[0].camera.pinhole = {100, 75, 128, 128, 49.5, 37};
  view.camera = silhouettes[0].camera;
  view.camera.camera_from_world.translation() += Vector3d(0.25, 0, 0);
  for (const double cy : {37.0, 36.5}) {
    view.camera.pinhole = {100, 75, 128, 128, 49.5, cy};
    EXPECT_GT(expect_definition(silhouettes, view, 7).hits, 50);
  }
}

}  // namespace
}  // namespace fivepipe::hull
