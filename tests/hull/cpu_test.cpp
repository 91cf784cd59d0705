// Backend `cpu` against the reference, on random rigs and on the hard cases of cameras, maps, rays
// and views.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/hull/cpu/cpu_hull.h"
#include "common/hull/oracle/reference.h"
#include "tests/support/hull_scenes.h"

namespace fivepipe::hull {
namespace {

using namespace test;
using Eigen::Vector3d;

// Hull pieces along a ray shorter than this are ties of pixel borders: rounding decides whether
// they exist.
constexpr double kTie_m = 1e-9;
constexpr double kAgree_m = 1e-6;  // the task's bound on depth; a float near 1 m is 6e-8 m coarse

// A ray's answers agree: same hit, same depth; a piece no longer than a tie may be found or not.
::testing::AssertionResult agree(float depth_m, const std::vector<Interval>& reference) {
  auto first = reference.begin();
  for (; first != reference.end() && first->leave - first->enter <= kTie_m; ++first)
    if (depth_m != kNoHull && std::abs(depth_m - first->enter) <= kAgree_m)
      return ::testing::AssertionSuccess();
  if (first == reference.end() ? depth_m == kNoHull : std::abs(depth_m - first->enter) <= kAgree_m)
    return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure()
         << "depth " << depth_m << " m, reference "
         << (first == reference.end() ? std::string("none") : std::to_string(first->enter));
}

// Every step-th ray of the view; returns how many hit.
int expect_reference(std::span<const Silhouette> silhouettes, const View& view, int step = 1) {
  const PixelRect rect = test::whole_image(view.camera);
  const DepthTile tile = test::cpu_depth(silhouettes, view, rect);
  int hits = 0;
  for (int i = 0; i < int(rect.area_px()); i += step) {
    const int u = i % rect.width_px(), v = i / rect.width_px();
    const geometry::Ray ray = geometry::ray_through(view.camera, Eigen::Vector2d(u, v));
    EXPECT_TRUE(
        agree(tile.depth_m[i], reference_intervals(silhouettes, ray, view.near_m, view.far_m)))
        << "ray " << u << ", " << v;
    hits += tile.depth_m[i] != kNoHull;
  }
  return hits;
}

bool no_hull(const DepthTile& tile) {
  return std::all_of(tile.depth_m.begin(), tile.depth_m.end(),
                     [](float d) { return d == kNoHull; });
}

TEST(CpuDepth, EqualsTheReferenceOnRandomRigs) {
  int hits = 0;
  for (int seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE(seed);
    test::Random random(seed);
    const auto cameras = test::random_cameras(random, 1 + seed % 6);
    const auto silhouettes = test::silhouettes_of(
        test::random_object(random, 3), cameras, seed % 2 ? PixelRule::touched : PixelRule::center);
    hits += expect_reference(silhouettes, {test::random_camera(random, 64, 48, 0.8), 0.05, 5.0}, 3);
  }
  EXPECT_GT(hits, 2000);
}

TEST(CpuDepth, EqualsTheReferenceOnRandomNoise) {  // pixels at random: every empty run is short,
                                                   // every cell mixed
  for (int seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(seed);
    test::Random random(seed);
    std::vector<Silhouette> silhouettes;
    for (const geometry::Camera& camera : test::random_cameras(random, 3, 90, 67))
      silhouettes.push_back(
          {camera, test::random_pixels(random, 90, 67, std::vector{0.003, 0.05, 0.4}[seed % 3])});
    expect_reference(silhouettes, {test::random_camera(random, 40, 30, 0.9), 0.01, 4.0}, 2);
  }
}

TEST(CpuDepth, SaltAndPepperNoiseOfOnePercentInEveryMap) {
  test::Random random(77);
  auto silhouettes =
      test::silhouettes_of(test::random_object(random, 4), test::random_cameras(random, 4));
  for (Silhouette& s : silhouettes)
    for (int i = 0; i < s.pixels.width_px() * s.pixels.height_px() / 100; ++i) {
      const int u = int(test::uniform(random, 0, s.pixels.width_px())),
                v = int(test::uniform(random, 0, s.pixels.height_px()));
      s.pixels.set(u, v, !s.pixels.contains(u, v));
    }
  EXPECT_GT(expect_reference(silhouettes, {test::random_camera(random, 80, 60, 0.9), 0.05, 4.0}, 3),
            50);
}

TEST(CpuDepth, IsBitIdenticalForEveryCameraOrder) {
  for (int seed = 1; seed <= 10; ++seed) {
    test::Random random(seed);
    auto silhouettes =
        test::silhouettes_of(test::random_object(random, 3), test::random_cameras(random, 4));
    const View view{test::random_camera(random, 80, 60, 0.8), 0.05, 5.0};
    const auto expected =
        test::cpu_depth(silhouettes, view, test::whole_image(view.camera)).depth_m;
    for (int i = 0; i < 5; ++i) {
      std::shuffle(silhouettes.begin(), silhouettes.end(), random);
      EXPECT_EQ(test::cpu_depth(silhouettes, view, test::whole_image(view.camera)).depth_m,
                expected);
    }
  }
}

TEST(CpuDepth, AnotherCameraNeverAddsVolume) {
  for (int seed = 1; seed <= 10; ++seed) {
    test::Random random(seed);
    const auto silhouettes =
        test::silhouettes_of(test::random_object(random, 3), test::random_cameras(random, 5));
    const View view{test::random_camera(random, 80, 60, 0.8), 0.05, 5.0};
    auto before =
        test::cpu_depth(std::span(silhouettes).first(1), view, test::whole_image(view.camera))
            .depth_m;
    for (std::size_t n = 2; n <= silhouettes.size(); ++n) {
      const auto now =
          test::cpu_depth(std::span(silhouettes).first(n), view, test::whole_image(view.camera))
              .depth_m;
      for (std::size_t i = 0; i < now.size(); ++i)
        EXPECT_TRUE(now[i] == kNoHull || (before[i] != kNoHull && now[i] >= before[i] - kAgree_m))
            << n << " cameras, ray " << i;
      before = now;
    }
  }
}

TEST(CpuDepth, TilesEqualTheWholeViewBitForBit) {
  test::Random random(5);
  const auto silhouettes =
      test::silhouettes_of(test::random_object(random, 4), test::random_cameras(random, 4));
  base::WorkerPool pool(2);
  CpuHull hull(pool, silhouettes);
  for (int seed = 1; seed <= 20; ++seed) {
    const View view{test::random_camera(random, 97, 61, 0.7), 0.05, 5.0};
    const DepthTile whole = hull.depth(view, test::whole_image(view.camera));
    const int u = int(test::uniform(random, 1, 96)), v = int(test::uniform(random, 1, 60));
    for (const PixelRect& rect : {PixelRect{0, 0, u, v},
                                  {u, 0, 97, v},
                                  {0, v, u, 61},
                                  {u, v, 97, 61},
                                  {u, v, u + 1, v + 1}}) {
      const DepthTile part = hull.depth(view, rect);
      for (int y = rect.v0_px; y < rect.v1_px; ++y)
        for (int x = rect.u0_px; x < rect.u1_px; ++x)
          ASSERT_EQ(part.depth_m[(y - rect.v0_px) * rect.width_px() + x - rect.u0_px],
                    whole.depth_m[y * 97 + x]);
    }
  }
}

TEST(CpuDepth, ContainsTheObjectWhereMapsAreTouched) {
  for (int seed = 1; seed <= 10; ++seed) {
    test::Random random(seed);
    const auto object = test::random_object(random, 3, 0.1);
    const auto silhouettes = test::silhouettes_of(object, test::random_cameras(random, 4));
    const View view{test::random_camera(random, 80, 60, 0.8), 0.02, 5.0};
    const DepthTile tile = test::cpu_depth(silhouettes, view, test::whole_image(view.camera));
    for (int i = 0; i < 80 * 60; ++i) {
      const geometry::Ray ray = geometry::ray_through(view.camera, Eigen::Vector2d(i % 80, i / 80));
      for (const Capsule& c : object) {
        const auto surface = ray_entry(c, ray);
        // Only of the part that every camera has in its image.
        if (!surface || *surface < view.near_m ||
            !in_hull(silhouettes, ray.origin_world_m + *surface * ray.direction_world))
          continue;
        EXPECT_TRUE(tile.depth_m[i] != kNoHull && tile.depth_m[i] <= *surface + kAgree_m);
      }
    }
  }
}

// --- cameras and maps
// ------------------------------------------------------------------------------------------

struct Square : ::testing::Test {  // two cameras at right angles, 2 m from the origin; a view from
                                   // a third side
  std::vector<Silhouette> silhouettes;
  View view{
      {geometry::pinhole_from_fov(64, 48, 0.5), geometry::look_at({-0.3, -2, 0.4}, {0, 0, 0})},
      0.05,
      10.0};
  Square() {
    for (const Vector3d& eye : {Vector3d(2, 0, 0), Vector3d(0, 2, 0)})
      silhouettes.push_back(
          {{geometry::pinhole_from_fov(100, 75, 0.5), geometry::look_at(eye, {0, 0, 0})},
           ObjectPixels(100, 75)});
  }
  void fill(int camera, const PixelRect& r) {
    for (int v = r.v0_px; v < r.v1_px; ++v)
      for (int u = r.u0_px; u < r.u1_px; ++u) silhouettes[camera].pixels.set(u, v);
  }
};

TEST_F(Square, NoObjectPixelInOneCamera) {
  fill(0, {30, 30, 60, 50});
  EXPECT_TRUE(no_hull(test::cpu_depth(silhouettes, view, test::whole_image(view.camera))));
}
TEST_F(Square, NoCamera) {
  EXPECT_TRUE(no_hull(test::cpu_depth({}, view, test::whole_image(view.camera))));
}
TEST_F(Square, AllPixelsObjectPixels) {
  fill(0, {0, 0, 100, 75});
  fill(1, {0, 0, 100, 75});
  EXPECT_GT(expect_reference(silhouettes, view), 500);
}
TEST_F(Square, OneObjectPixel) {  // a hull of 2 cm at most: seen by the ray through it, and nearly
                                  // nowhere else
  fill(0, {50, 37, 51, 38});
  fill(1, {50, 37, 51, 38});
  view.camera.pinhole = geometry::pinhole_from_fov(320, 240, 0.1);
  EXPECT_GT(expect_reference(silhouettes, view), 10);
}
TEST_F(Square, MapOfSizeZero) {
  silhouettes[0].pixels = ObjectPixels(0, 0);
  fill(1, {0, 0, 100, 75});
  EXPECT_TRUE(no_hull(test::cpu_depth(silhouettes, view, test::whole_image(view.camera))));
}
TEST_F(Square, MapOfOnePixel) {
  silhouettes[0] = {
      {geometry::pinhole_from_fov(1, 1, 0.2), silhouettes[0].camera.camera_from_world},
      ObjectPixels(1, 1)};
  fill(0, {0, 0, 1, 1});
  fill(1, {20, 20, 70, 60});
  EXPECT_GT(expect_reference(silhouettes, view), 50);
}
TEST_F(Square, MapsWhoseWidthIsNoMultipleOfEightOr64) {
  test::Random random(3);
  for (const int width : {7, 9, 63, 64, 65, 127, 129}) {
    SCOPED_TRACE(width);
    for (int i = 0; i < 2; ++i)
      silhouettes[i] = {
          {geometry::pinhole_from_fov(width, 33, 0.5), silhouettes[i].camera.camera_from_world},
          test::random_pixels(random, width, 33, 0.3)};
    EXPECT_GT(expect_reference(silhouettes, view, 5), 0);
  }
}
TEST_F(Square, ObjectCutByTheImageBorder) {
  fill(0, {80, 0, 100, 40});
  fill(1, {40, 0, 100, 75});
  EXPECT_GT(expect_reference(silhouettes, view), 0);
}
TEST_F(Square, TwoCamerasWithTheSamePose) {
  silhouettes[1].camera = silhouettes[0].camera;
  fill(0, {30, 30, 60, 50});
  fill(1, {50, 20, 80, 40});
  EXPECT_GT(expect_reference(silhouettes, view), 50);
}
TEST_F(Square, OpposedCamerasOnOneLine) {
  silhouettes[1].camera.camera_from_world = geometry::look_at({-2, 0, 0}, {0, 0, 0});
  fill(0, {30, 30, 60, 50});
  fill(1, {40, 20, 80, 60});
  EXPECT_GT(expect_reference(silhouettes, view), 50);
}
TEST_F(Square, NearlyParallelRays) {  // cameras 1 um apart: their intersection is long and thin
  silhouettes[1].camera.camera_from_world = geometry::look_at({2, 1e-6, 0}, {0, 1e-6, 0});
  fill(0, {30, 30, 60, 50});
  fill(1, {59, 30, 80, 50});
  EXPECT_GT(expect_reference(silhouettes, view), 0);
}
TEST_F(Square, AllCamerasInOnePlaneThroughTheObject) {
  for (const double angle : {0.4, 1.1, 2.5})
    silhouettes.push_back(
        {{geometry::pinhole_from_fov(100, 75, 0.5),
          geometry::look_at(2 * Vector3d(std::cos(angle), std::sin(angle), 0), {0, 0, 0})},
         ObjectPixels(100, 75)});
  for (int i = 0; i < int(silhouettes.size()); ++i) fill(i, {35, 25, 65, 50});
  EXPECT_GT(expect_reference(silhouettes, view), 50);
}
TEST_F(Square, ExtremeFocalLengths) {
  for (const double f : {50.0, 50000.0}) {
    SCOPED_TRACE(f);
    silhouettes[0].camera.pinhole.fx_px = silhouettes[0].camera.pinhole.fy_px = f;
    silhouettes[0].camera.camera_from_world =
        geometry::look_at({f > 1000 ? 200.0 : 1.0, 0, 0}, {0, 0, 0});
    fill(0, {30, 30, 60, 50});
    fill(1, {10, 10, 90, 70});
    EXPECT_GT(expect_reference(silhouettes, view), 20);
  }
}
TEST_F(Square, RotationSlightlyOffOrthonormal) {
  silhouettes[0].camera.camera_from_world.linear()(0, 1) += 5e-4;
  fill(0, {30, 30, 60, 50});
  fill(1, {10, 10, 90, 70});
  EXPECT_GT(expect_reference(silhouettes, view), 20);
}
TEST_F(Square, NotANumberInACalibrationHasNoHull) {
  fill(0, {0, 0, 100, 75});
  fill(1, {0, 0, 100, 75});
  const auto good = silhouettes;
  const double bad_numbers[] = {std::numeric_limits<double>::quiet_NaN(),
                                std::numeric_limits<double>::infinity()};
  for (const double bad : bad_numbers) {
    for (double geometry::Pinhole::*field :
         {&geometry::Pinhole::fx_px, &geometry::Pinhole::cy_px}) {
      silhouettes = good;
      silhouettes[1].camera.pinhole.*field = bad;
      EXPECT_TRUE(no_hull(test::cpu_depth(silhouettes, view, test::whole_image(view.camera))));
    }
    silhouettes = good;
    silhouettes[0].camera.camera_from_world.translation().y() = bad;
    EXPECT_TRUE(no_hull(test::cpu_depth(silhouettes, view, test::whole_image(view.camera))));
    View bad_view = view;
    bad_view.camera.camera_from_world.linear()(1, 1) = bad;
    EXPECT_TRUE(no_hull(test::cpu_depth(good, bad_view, test::whole_image(view.camera))));
    bad_view = view;
    bad_view.far_m = bad;
    EXPECT_TRUE(no_hull(test::cpu_depth(good, bad_view, test::whole_image(view.camera))));
  }
}

TEST(CpuDepth, ManyCameras) {
  for (const int n : {1, 2, 3, 4, 16, 64}) {
    SCOPED_TRACE(n);
    test::Random random(n);
    expect_reference(test::silhouettes_of(test::random_object(random, 2, 0.1),
                                          test::random_cameras(random, n, 64, 48)),
                     {test::random_camera(random, 48, 36, 0.8), 0.05, 5.0}, 5);
  }
}

// --- rays and views
// --------------------------------------------------------------------------------------------

TEST_F(Square, EyeInsideTheHull) {
  fill(0, {10, 10, 90, 70});
  fill(1, {10, 10, 90, 70});
  view.camera.camera_from_world = geometry::look_at({0.01, 0, 0.02}, {1, 1, 0});
  for (const float d : test::cpu_depth(silhouettes, view, test::whole_image(view.camera)).depth_m)
    EXPECT_EQ(d, float(view.near_m));
}
TEST_F(Square, NearPlaneInsideTheObject) {
  fill(0, {10, 10, 90, 70});
  fill(1, {10, 10, 90, 70});
  view.near_m = 2.0;
  const auto tile = test::cpu_depth(silhouettes, view, test::whole_image(view.camera));
  EXPECT_EQ(tile.depth_m[24 * 64 + 32], 2.0f);
  expect_reference(silhouettes, view);
}
TEST_F(Square, RayThroughACameraCentreAndCameraInTheView) {  // the view looks along a camera's
                                                             // axis, from behind it and through it
  fill(0, {10, 10, 90, 70});
  fill(1, {10, 10, 90, 70});
  for (const Vector3d& eye : {Vector3d(3, 0, 0), Vector3d(2, 0, 0), Vector3d(3, 0.25, 0.125)}) {
    view.camera.camera_from_world =
        geometry::look_at(eye, eye.y() == 0 ? Vector3d(0, 0, 0) : Vector3d(2, 0, 0));
    view.camera.pinhole = {65,  49, 100,
                           100, 32, 24};  // the middle ray goes exactly through the centre
    EXPECT_GT(expect_reference(silhouettes, view), 100);
  }
}
TEST_F(Square, DepthOfACameraCrossesZeroAlongTheRay) {  // rays that pass beside a camera from its
                                                        // back to its front and the reverse
  fill(0, {0, 0, 100, 75});
  fill(1, {0, 0, 100, 75});
  test::Random random(8);
  for (int i = 0; i < 30; ++i) {
    view.camera = {
        geometry::pinhole_from_fov(40, 30, 1.5),
        geometry::look_at(Vector3d(2, 0, 0) + test::random_in_ball(random, 0.5),
                          test::random_in_ball(random, 1.0), test::random_direction(random))};
    EXPECT_GT(expect_reference(silhouettes, view, 3), 0);
  }
}
TEST_F(Square, ImageOfRaysAlongPixelEdges) {  // the view shares a camera's axes: epipolar lines run
                                              // along rows, on edges and centres
  fill(0, {20, 20, 80, 60});
  fill(1, {20, 20, 80, 60});
  silhouettes[0].camera.pinhole = {100, 75, 128, 128, 49.5, 37};
  view.camera = silhouettes[0].camera;
  view.camera.camera_from_world.translation() += Vector3d(0.25, 0, 0);
  for (const double cy : {37.0, 36.5}) {
    view.camera.pinhole = {100, 75, 128, 128, 49.5, cy};
    const DepthTile tile = test::cpu_depth(silhouettes, view, test::whole_image(view.camera));
    for (const float d : tile.depth_m)
      EXPECT_TRUE(d == kNoHull || (d >= view.near_m && d < view.far_m));
    if (cy == 37.0) {
      EXPECT_GT(expect_reference(silhouettes, view), 500);
    }
  }
}
TEST_F(Square, HullThinnerThanAPixelOfTheView) {
  fill(0, {49, 0, 51, 75});
  fill(1, {0, 36, 100, 39});
  view.camera.pinhole =
      geometry::pinhole_from_fov(31, 21, 0.9);  // the middle ray goes through it, few others
  EXPECT_GT(expect_reference(silhouettes, view), 0);
}
TEST_F(Square, TwoHullPartsOneBehindTheOther) {
  fill(0, {20, 20, 30, 60});
  fill(0, {70, 20, 80, 60});
  fill(1, {40, 20, 60, 60});
  view.camera.camera_from_world = geometry::look_at({0, -3, 0.1}, {0, 0, 0});
  const geometry::Ray ray = geometry::ray_through(view.camera, Eigen::Vector2d(32, 24));
  EXPECT_EQ(reference_intervals(silhouettes, ray, view.near_m, view.far_m).size(), 2u);
  EXPECT_GT(expect_reference(silhouettes, view), 50);
}
TEST_F(Square, GhostVolumes) {  // two objects, two cameras: four parts, two of them ghosts
  for (int i = 0; i < 2; ++i) {
    fill(i, {20, 20, 35, 60});
    fill(i, {65, 20, 80, 60});
  }
  EXPECT_GT(expect_reference(silhouettes, view), 50);
}
TEST_F(Square, HullTouchingTheNearOrFarPlane) {
  fill(0, {20, 20, 80, 60});
  fill(1, {20, 20, 80, 60});
  const auto pieces =
      reference_intervals(silhouettes, geometry::ray_through(view.camera, Eigen::Vector2d(32, 24)),
                          view.near_m, view.far_m);
  ASSERT_EQ(pieces.size(), 1u);
  const double enter = pieces[0].enter, leave = pieces[0].leave;
  const auto middle = [&](double near, double far) {
    return test::cpu_depth(silhouettes, {view.camera, near, far}, {32, 24, 33, 25}).depth_m[0];
  };
  EXPECT_EQ(middle(0.05, enter * (1 - 1e-9)), kNoHull);
  EXPECT_EQ(middle(0.05, enter * (1 + 1e-9)), float(enter));
  EXPECT_EQ(middle(leave * (1 + 1e-9), 10), kNoHull);
  EXPECT_EQ(middle(leave * (1 - 1e-9), 10), float(leave * (1 - 1e-9)));
}
TEST_F(Square, PointsOneKilometreAway) {
  silhouettes[0].camera.camera_from_world = geometry::look_at({1000, 0, 0}, {0, 0, 0});
  fill(0, {0, 0, 100, 75});
  fill(1, {20, 20, 80, 60});
  EXPECT_GT(expect_reference(silhouettes, view), 100);
}

}  // namespace
}  // namespace fivepipe::hull
