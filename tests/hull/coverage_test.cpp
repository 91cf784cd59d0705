// The hull of coverage maps against its definition, sampled densely along seeded rays, and on the
// hard cases of maps, cameras and views.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/hull/silhouette/coverage_hull.h"
#include "tests/support/hull_scenes.h"

namespace fivepipe::hull {
namespace {

using namespace test;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kSamples = 4000;     // of the definition along a ray
constexpr double kAgree_m = 1e-6;  // a float near 1 m is 6e-8 m coarse
// Coverage at a border as far as a depth in float can tell it: 2e-7 m times 1000 px per metre, the
// finest map here, times 1 per px.
constexpr double kOnBorder = 1e-3;
constexpr double kNearestSample_m = 1e-9;

base::WorkerPool& test_pool() {
  static base::WorkerPool pool(2);
  return pool;
}
DepthTile depth_of(std::span<const CoverageSilhouette> silhouettes, const View& view) {
  return CoverageHull(test_pool(), silhouettes).depth(view, test::whole_image(view.camera));
}

// The definition, written a second time: weights of the four nearest centres. Least coverage over
// the cameras; -1 where one does not see p.
double min_coverage(std::span<const CoverageSilhouette> silhouettes, const Vector3d& p_world_m) {
  double least = silhouettes.empty() ? -1 : 1;
  for (const CoverageSilhouette& s : silhouettes) {
    const auto uv = geometry::project(s.camera, p_world_m);
    const int width = s.map.width_px(), height = s.map.height_px();
    if (!uv ||
        !(uv->x() >= -0.5 && uv->y() >= -0.5 && uv->x() < width - 0.5 && uv->y() < height - 0.5))
      return -1;
    const double u = std::clamp(uv->x(), 0.0, width - 1.0),
                 v = std::clamp(uv->y(), 0.0, height - 1.0);
    double coverage = 0;
    for (int y = int(v); y <= std::min(int(v) + 1, height - 1); ++y)
      for (int x = int(u); x <= std::min(int(u) + 1, width - 1); ++x)
        coverage += (1 - std::abs(u - x)) * (1 - std::abs(v - y)) * s.map.at(x, y) / 255.0;
    least = std::min(least, coverage);
  }
  return least;
}

struct Counts {
  int hits = 0, between_samples = 0;
};

// One ray: the first sample in the hull, and the border before it by bisection. A piece that lies
// between two samples is held only against the definition at its beginning, and counted.
void expect_definition(Counts& counts, std::span<const CoverageSilhouette> silhouettes,
                       const geometry::Ray& ray, const View& view, float depth_m) {
  const auto coverage = [&](double t) {
    return min_coverage(silhouettes, ray.origin_world_m + t * ray.direction_world);
  };
  const double step = (view.far_m - view.near_m) / kSamples;
  double expected = kNoHull;
  for (int i = 0; i < kSamples; ++i) {
    double in = i == 0 ? view.near_m + kNearestSample_m : view.near_m + i * step,
           out = view.near_m + std::max(i - 1, 0) * step;
    if (coverage(in) < 0.5) continue;
    for (int k = 0; i > 0 && k < 50; ++k)
      (coverage(0.5 * (out + in)) >= 0.5 ? in : out) = 0.5 * (out + in);
    expected = i == 0 ? view.near_m : in;
    break;
  }
  counts.hits += depth_m != kNoHull;
  if (std::abs(depth_m - expected) <= kAgree_m) return;
  EXPECT_TRUE(depth_m != kNoHull && (expected == kNoHull || depth_m < expected))
      << "depth " << depth_m << " m, expected " << expected;
  ++counts.between_samples;
  const double slack = kAgree_m;
  EXPECT_GE(std::max({coverage(depth_m - slack), coverage(depth_m), coverage(depth_m + slack)}),
            0.5 - kOnBorder)
      << "depth " << depth_m << " m is not in the hull";
}

Counts expect_definition(std::span<const CoverageSilhouette> silhouettes, const View& view,
                         int step = 1) {
  Counts counts;
  const DepthTile tile = depth_of(silhouettes, view);
  const int width = tile.rect.width_px();
  for (int i = 0; i < int(tile.depth_m.size()); i += step) {
    SCOPED_TRACE(i);
    expect_definition(counts, silhouettes,
                      geometry::ray_through(view.camera, Vector2d(i % width, i / width)), view,
                      tile.depth_m[i]);
  }
  return counts;
}

bool no_hull(const DepthTile& tile) {
  return std::all_of(tile.depth_m.begin(), tile.depth_m.end(),
                     [](float d) { return d == kNoHull; });
}

std::vector<CoverageSilhouette> covered(const std::vector<Capsule>& object,
                                        const std::vector<geometry::Camera>& cameras) {
  std::vector<CoverageSilhouette> silhouettes;
  for (const geometry::Camera& camera : cameras)
    silhouettes.push_back({camera, true_coverage(object, camera)});
  return silhouettes;
}

CoverageMap random_map(test::Random& random, int width_px, int height_px, double inside_fraction) {
  CoverageMap map(width_px, height_px);
  for (int v = 0; v < height_px; ++v)
    for (int u = 0; u < width_px; ++u)
      map.set(u, v,
              std::uint8_t(test::uniform(random, 0, 1) < inside_fraction
                               ? test::uniform(random, 128, 256)
                               : test::uniform(random, 0, 128)));
  return map;
}

TEST(TrueCoverage, IsThatOfManySamples) {
  for (int seed = 1; seed <= 4; ++seed) {
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
            << u << ", " << v;  // and the samples' own error
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
    const auto silhouettes =
        covered(test::random_object(random, 3), test::random_cameras(random, 1 + seed % 6, 80, 61));
    const Counts c =
        expect_definition(silhouettes, {test::random_camera(random, 64, 48, 0.8), 0.05, 3.0}, 7);
    counts = {counts.hits + c.hits, counts.between_samples + c.between_samples};
  }
  EXPECT_GT(counts.hits, 500);
  EXPECT_LE(counts.between_samples, counts.hits / 50);
}

TEST(CoverageHull,
     EqualsItsDefinitionOnNoise) {  // every cell another, saddles and small loops in most
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
      covered(test::random_object(random, 3), test::random_cameras(random, 4, 160, 121));
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
        covered(test::random_object(random, 3), test::random_cameras(random, 4, 80, 61));
    const View view{test::random_camera(random, 80, 60, 0.8), 0.05, 5.0};
    const SurfaceTile expected = CoverageHull(one, silhouettes).surface(view, {0, 0, 80, 60});
    for (int i = 0; i < 4; ++i) {
      std::shuffle(silhouettes.begin(), silhouettes.end(), random);
      CoverageHull hull(three, silhouettes);
      const SurfaceTile tile = hull.surface(view, {0, 0, 80, 60});
      EXPECT_EQ(tile.depth_m, expected.depth_m);
      EXPECT_EQ(tile.normal_world, expected.normal_world);
      const DepthTile part = hull.depth(view, {11, 7, 50, 33});
      for (int v = 7; v < 33; ++v)
        for (int u = 11; u < 50; ++u)
          ASSERT_EQ(part.depth_m[(v - 7) * 39 + u - 11], expected.depth_m[v * 80 + u]);
    }
  }
}

TEST(CoverageHull, NormalsAreUnitFaceTheViewAndLieAcrossTheLimitingCamerasSight) {
  test::Random random(4);
  const auto silhouettes =
      covered(test::random_object(random, 2), test::random_cameras(random, 5, 320, 241));
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
            hits / 50);  // the fit is not the tangent: where a ray grazes, it may look past it
}

// --- cameras and maps
// ------------------------------------------------------------------------------------------

struct CoverageSquare : ::testing::Test {  // two cameras at right angles, 2 m from the origin; a
                                           // view from a third side
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
    for (int v = r.v0_px; v < r.v1_px; ++v)
      for (int u = r.u0_px; u < r.u1_px; ++u) silhouettes[camera].map.set(u, v, coverage);
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

TEST_F(CoverageSquare, NothingCoveredInOneCamera) {
  fill(0, {30, 30, 60, 50});
  EXPECT_TRUE(no_hull(depth_of(silhouettes, view)));
}
TEST_F(CoverageSquare, JustBelowOneHalfIsNothing) {
  fill(0, {30, 30, 60, 50});
  fill(1, {0, 0, 100, 75}, 127);
  EXPECT_TRUE(no_hull(depth_of(silhouettes, view)));
  fill(1, {0, 0, 100, 75}, 128);
  EXPECT_FALSE(no_hull(depth_of(silhouettes, view)));
}
TEST_F(CoverageSquare, NoCamera) { EXPECT_TRUE(no_hull(depth_of({}, view))); }
TEST_F(CoverageSquare, AllCoveredIsTheHullOfAllPixels) {  // and its border, that of the images
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
TEST_F(CoverageSquare, StraightBordersOfBinaryMapsAreThePixels) {  // half way from an object
                                                                   // pixel's centre to the next
  fill(0, {30, 0, 60, 75});
  fill(1, {20, 0, 80, 75});
  const DepthTile tile = depth_of(silhouettes, view),
                  expected =
                      CpuHull(test_pool(), binary()).depth(view, test::whole_image(view.camera));
  for (std::size_t i = 0; i < tile.depth_m.size(); ++i)
    EXPECT_NEAR(tile.depth_m[i], expected.depth_m[i], kAgree_m);
  EXPECT_FALSE(no_hull(tile));
}
TEST_F(CoverageSquare,
       StraightBordersBetweenPixelsLieWhereTheCoverageSays) {  // 255 beside c: one half is (255 -
                                                               // 127.5) / (255 - c) px on
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
TEST_F(CoverageSquare,
       TiesBetweenLimitingCamerasAreIndependentOfOrder) {  // one pose, one border, but other
                                                           // coverage beside it: other normals
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
TEST_F(CoverageSquare, MapOfSizeZero) {
  silhouettes[0].map = CoverageMap(0, 0);
  fill(1, {0, 0, 100, 75});
  EXPECT_TRUE(no_hull(depth_of(silhouettes, view)));
  EXPECT_EQ(silhouettes[0].map.interpolated(0, 0), 0);
}
TEST_F(CoverageSquare, MapOfOnePixel) {  // clamped on all sides: its square, all or nothing
  silhouettes[0] = {
      {geometry::pinhole_from_fov(1, 1, 0.2), silhouettes[0].camera.camera_from_world},
      CoverageMap(1, 1)};
  fill(0, {0, 0, 1, 1}, 128);
  fill(1, {20, 20, 70, 60});
  EXPECT_GT(expect_definition(silhouettes, view, 3).hits, 20);
  fill(0, {0, 0, 1, 1}, 127);
  EXPECT_TRUE(no_hull(depth_of(silhouettes, view)));
}
TEST_F(CoverageSquare, OneRowOrColumn) {
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
TEST_F(CoverageSquare, ObjectCutByTheImageBorder) {
  fill(0, {80, 0, 100, 40}, 200);
  fill(1, {40, 0, 100, 75}, 180);
  expect_definition(silhouettes, view, 3);
}
TEST_F(CoverageSquare, OutsideEveryImageAndForNaNNothingIsCovered) {
  fill(0, {0, 0, 100, 75});
  const CoverageMap& map = silhouettes[0].map;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(map.interpolated(-0.5, -0.5), 1);
  for (const auto& [u, v] :
       {std::pair(-0.51, 0.0), {99.5, 0.0}, {0.0, 74.5}, {0.0, -0.51}, {nan, 0.0}, {0.0, nan}})
    EXPECT_EQ(map.interpolated(u, v), 0);
  EXPECT_FALSE(in_hull(silhouettes, {nan, 0, 0}));
  EXPECT_FALSE(in_hull(std::span<const CoverageSilhouette>(), Vector3d::Zero()));
  EXPECT_FALSE(outward_in_image(map, {50, 37}));  // the same all around
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

// --- rays and views
// --------------------------------------------------------------------------------------------

TEST_F(CoverageSquare, EyeInsideTheHull) {
  fill(0, {10, 10, 90, 70});
  fill(1, {10, 10, 90, 70});
  view.camera.camera_from_world = geometry::look_at({0.01, 0, 0.02}, {1, 1, 0});
  const SurfaceTile tile =
      CoverageHull(test_pool(), silhouettes).surface(view, test::whole_image(view.camera));
  for (const float d : tile.depth_m) EXPECT_EQ(d, float(view.near_m));
  for (const std::int16_t camera : tile.limiting) EXPECT_EQ(camera, -1);
}
TEST_F(CoverageSquare, RayThroughACameraCentreAndCameraInTheView) {  // whose image there stands
                                                                     // still, or comes from behind
  fill(0, {10, 10, 90, 70}, 220);
  fill(1, {10, 10, 90, 70}, 190);
  for (const Vector3d& eye : {Vector3d(3, 0, 0), Vector3d(2, 0, 0), Vector3d(3, 0.25, 0.125)}) {
    view.camera.camera_from_world =
        geometry::look_at(eye, eye.y() == 0 ? Vector3d(0, 0, 0) : Vector3d(2, 0, 0));
    view.camera.pinhole = {65, 49, 100, 100, 32, 24};
    EXPECT_GT(expect_definition(silhouettes, view, 5).hits, 50);
  }
}
TEST_F(CoverageSquare, RaysAlongCellBorders) {  // the view shares a camera's axes: images run along
                                                // rows, on centres and between them
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
