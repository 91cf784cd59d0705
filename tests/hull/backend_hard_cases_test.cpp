// Hard cases of cameras, maps, rays and views for the exact depth backends, against the reference.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/hull/backends.h"

namespace fivepipe::hull {
namespace {

using namespace test;
using Eigen::Vector3d;

// Two cameras at right angles, 2 m from the origin, and a view from a third side.
struct HullBackendHardCase : ForHullBackends {
  std::vector<Silhouette> silhouettes;
  View view{
      {geometry::pinhole_from_fov(64, 48, 0.5), geometry::look_at({-0.3, -2, 0.4}, {0, 0, 0})},
      0.05,
      10.0};
  HullBackendHardCase() {
    for (const Vector3d& eye : {Vector3d(2, 0, 0), Vector3d(0, 2, 0)})
      silhouettes.push_back(
          {{geometry::pinhole_from_fov(100, 75, 0.5), geometry::look_at(eye, {0, 0, 0})},
           ObjectPixels(100, 75)});
  }
  void fill(std::size_t camera, const PixelRect& r) {
    for (int v = r.v0_px; v < r.v1_px; ++v)
      for (int u = r.u0_px; u < r.u1_px; ++u) silhouettes[camera].pixels.set(u, v);
  }
  void fill_both(const PixelRect& r) {
    fill(0, r);
    fill(1, r);
  }
};
INSTANTIATE_TEST_SUITE_P(Hull, HullBackendHardCase, ::testing::Values("cpu", "gl"), backend_name);

TEST_P(HullBackendHardCase, AllPixelsObjectPixels) {
  fill_both({0, 0, 100, 75});
  EXPECT_GT(expect_reference(silhouettes, view), 500);
}

// One pixel of each camera limits the hull to at most 2 cm.
TEST_P(HullBackendHardCase, OneObjectPixel) {
  fill_both({50, 37, 51, 38});
  view.camera.pinhole = geometry::pinhole_from_fov(320, 240, 0.1);
  EXPECT_GT(expect_reference(silhouettes, view), 10);
}

TEST_P(HullBackendHardCase, MapOfSizeZero) {
  silhouettes[0].pixels = ObjectPixels(0, 0);
  fill(1, {0, 0, 100, 75});
  EXPECT_TRUE(no_hull(depth(silhouettes, view)));
}

TEST_P(HullBackendHardCase, MapOfOnePixel) {
  silhouettes[0] = {
      {geometry::pinhole_from_fov(1, 1, 0.2), silhouettes[0].camera.camera_from_world},
      ObjectPixels(1, 1)};
  fill(0, {0, 0, 1, 1});
  fill(1, {20, 20, 70, 60});
  EXPECT_GT(expect_reference(silhouettes, view), 50);
}

TEST_P(HullBackendHardCase, MapsWhoseWidthIsNoMultipleOfEightOr64) {
  Random random(3);
  for (const int width : {7, 9, 63, 64, 65, 127, 129}) {
    SCOPED_TRACE(width);
    for (int i = 0; i < 2; ++i)
      silhouettes[i] = {
          {geometry::pinhole_from_fov(width, 33, 0.5), silhouettes[i].camera.camera_from_world},
          random_pixels(random, width, 33, 0.3)};
    EXPECT_GT(expect_reference(silhouettes, view, 5), 0);
  }
}

TEST_P(HullBackendHardCase, ObjectCutByTheImageBorder) {
  fill(0, {80, 0, 100, 40});
  fill(1, {40, 0, 100, 75});
  EXPECT_GT(expect_reference(silhouettes, view), 0);
}

TEST_P(HullBackendHardCase, TwoCamerasWithTheSamePose) {
  silhouettes[1].camera = silhouettes[0].camera;
  fill(0, {30, 30, 60, 50});
  fill(1, {50, 20, 80, 40});
  EXPECT_GT(expect_reference(silhouettes, view), 50);
}

TEST_P(HullBackendHardCase, OpposedCamerasOnOneLine) {
  silhouettes[1].camera.camera_from_world = geometry::look_at({-2, 0, 0}, {0, 0, 0});
  fill(0, {30, 30, 60, 50});
  fill(1, {40, 20, 80, 60});
  EXPECT_GT(expect_reference(silhouettes, view), 50);
}

// With cameras 1 um apart the intersection of their rays is long and thin.
TEST_P(HullBackendHardCase, NearlyParallelRays) {
  silhouettes[1].camera.camera_from_world = geometry::look_at({2, 1e-6, 0}, {0, 1e-6, 0});
  fill(0, {30, 30, 60, 50});
  fill(1, {59, 30, 80, 50});
  EXPECT_GT(expect_reference(silhouettes, view), 0);
}

TEST_P(HullBackendHardCase, AllCamerasInOnePlaneThroughTheObject) {
  for (const double angle : {0.4, 1.1, 2.5})
    silhouettes.push_back(
        {{geometry::pinhole_from_fov(100, 75, 0.5),
          geometry::look_at(2 * Vector3d(std::cos(angle), std::sin(angle), 0), {0, 0, 0})},
         ObjectPixels(100, 75)});
  for (int i = 0; i < int(silhouettes.size()); ++i) fill(i, {35, 25, 65, 50});
  EXPECT_GT(expect_reference(silhouettes, view), 50);
}

TEST_P(HullBackendHardCase, ExtremeFocalLengths) {
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

TEST_P(HullBackendHardCase, RotationSlightlyOffOrthonormal) {
  silhouettes[0].camera.camera_from_world.linear()(0, 1) += 5e-4;
  fill(0, {30, 30, 60, 50});
  fill(1, {10, 10, 90, 70});
  EXPECT_GT(expect_reference(silhouettes, view), 20);
}

TEST_P(HullBackendHardCase, EyeInsideTheHull) {
  fill_both({10, 10, 90, 70});
  view.camera.camera_from_world = geometry::look_at({0.01, 0, 0.02}, {1, 1, 0});
  for (const float d : depth(silhouettes, view).depth_m) EXPECT_EQ(d, float(view.near_m));
}

TEST_P(HullBackendHardCase, NearPlaneInsideTheObject) {
  fill_both({10, 10, 90, 70});
  view.near_m = 2.0;
  const auto tile = depth(silhouettes, view);
  EXPECT_EQ(tile.depth_m[24 * 64 + 32], 2.0f);
  expect_reference(silhouettes, view);
}

// The view looks along a camera's axis, from behind the camera and through its centre.
TEST_P(HullBackendHardCase, RayThroughACameraCentreAndCameraInTheView) {
  fill_both({10, 10, 90, 70});
  for (const Vector3d& eye : {Vector3d(3, 0, 0), Vector3d(2, 0, 0), Vector3d(3, 0.25, 0.125)}) {
    view.camera.camera_from_world =
        geometry::look_at(eye, eye.y() == 0 ? Vector3d(0, 0, 0) : Vector3d(2, 0, 0));
    // The central ray passes exactly through the camera's centre.
    view.camera.pinhole = {65, 49, 100, 100, 32, 24};
    EXPECT_GT(expect_reference(silhouettes, view), 100);
  }
}

// Rays pass a camera from its back to its front and the reverse.
TEST_P(HullBackendHardCase, DepthOfACameraCrossesZeroAlongTheRay) {
  fill_both({0, 0, 100, 75});
  Random random(8);
  for (int i = 0; i < 30; ++i) {
    view.camera = {geometry::pinhole_from_fov(40, 30, 1.5),
                   random_look_at(random, Vector3d(2, 0, 0) + random_in_ball(random, 0.5),
                                  Vector3d::Zero(), 1.0)};
    EXPECT_GT(expect_reference(silhouettes, view, 3), 0);
  }
}

// The view shares a camera's axes, so epipolar lines run along rows, on pixel edges and centres.
TEST_P(HullBackendHardCase, ImageOfRaysAlongPixelEdges) {
  fill_both({20, 20, 80, 60});
  silhouettes[0].camera.pinhole = {100, 75, 128, 128, 49.5, 37};
  view.camera = silhouettes[0].camera;
  view.camera.camera_from_world.translation() += Vector3d(0.25, 0, 0);
  for (const double cy : {37.0, 36.5}) {
    view.camera.pinhole = {100, 75, 128, 128, 49.5, cy};
    const DepthTile tile = depth(silhouettes, view);
    for (const float d : tile.depth_m)
      EXPECT_TRUE(d == kNoHull || (d >= view.near_m && d < view.far_m));
    if (cy == 37.0) {
      EXPECT_GT(expect_reference(silhouettes, view), 500);
    }
  }
}

TEST_P(HullBackendHardCase, HullThinnerThanAPixelOfTheView) {
  fill(0, {50, 0, 51, 75});
  fill(1, {0, 37, 100, 38});
  view.camera.pinhole = geometry::pinhole_from_fov(30, 20, 0.9);  // hardly any ray meets it
  expect_reference(silhouettes, view);
  fill(0, {49, 0, 51, 75});
  fill(1, {0, 36, 100, 39});
  view.camera.pinhole = geometry::pinhole_from_fov(31, 21, 0.9);  // the central ray meets it
  EXPECT_GT(expect_reference(silhouettes, view), 0);
}

TEST_P(HullBackendHardCase, TwoHullComponentsOneBehindTheOther) {
  fill(0, {20, 20, 30, 60});
  fill(0, {70, 20, 80, 60});
  fill(1, {40, 20, 60, 60});
  view.camera.camera_from_world = geometry::look_at({0, -3, 0.1}, {0, 0, 0});
  const geometry::Ray ray = geometry::ray_through(view.camera, Eigen::Vector2d(32, 24));
  EXPECT_EQ(reference_intervals(silhouettes, ray, view.near_m, view.far_m).size(), 2u);
  EXPECT_GT(expect_reference(silhouettes, view), 50);
}

// Two objects and two cameras: the hull has four parts, two of which are ghosts.
TEST_P(HullBackendHardCase, GhostVolumes) {
  for (int i = 0; i < 2; ++i) {
    fill(i, {20, 20, 35, 60});
    fill(i, {65, 20, 80, 60});
  }
  EXPECT_GT(expect_reference(silhouettes, view), 50);
}

TEST_P(HullBackendHardCase, HullTouchingTheNearOrFarPlane) {
  fill_both({20, 20, 80, 60});
  const auto pieces =
      reference_intervals(silhouettes, geometry::ray_through(view.camera, Eigen::Vector2d(32, 24)),
                          view.near_m, view.far_m);
  ASSERT_EQ(pieces.size(), 1u);
  const double enter = pieces[0].enter, leave = pieces[0].leave;
  backend().set_silhouettes(silhouettes);
  const auto central_depth = [&](double near, double far) {
    return depth_of(backend(), {32, 24, 33, 25}, {view.camera, near, far}).depth_m[0];
  };
  EXPECT_EQ(central_depth(0.05, enter * (1 - 1e-9)), kNoHull);
  EXPECT_EQ(central_depth(0.05, enter * (1 + 1e-9)), float(enter));
  EXPECT_EQ(central_depth(leave * (1 + 1e-9), 10), kNoHull);
  EXPECT_EQ(central_depth(leave * (1 - 1e-9), 10), float(leave * (1 - 1e-9)));
}

TEST_P(HullBackendHardCase, PointsOneKilometreAway) {
  silhouettes[0].camera.camera_from_world = geometry::look_at({1000, 0, 0}, {0, 0, 0});
  fill(0, {0, 0, 100, 75});
  fill(1, {20, 20, 80, 60});
  EXPECT_GT(expect_reference(silhouettes, view), 100);
}

TEST_P(HullBackendHardCase, EyeAtACameraCentre) {
  fill(0, {10, 10, 90, 70});
  fill(1, {33, 20, 60, 55});
  view.camera.camera_from_world = silhouettes[0].camera.camera_from_world;
  EXPECT_GT(expect_reference(silhouettes, view), 50);
  view.camera = silhouettes[0].camera;  // each ray passes through the centre of one map pixel
  EXPECT_GT(expect_reference(silhouettes, view), 50);
}

TEST_P(HullBackendHardCase, TwoCamerasOfOnePoseAndOpposedCameras) {
  fill_both({20, 20, 80, 60});
  silhouettes.push_back(silhouettes[0]);
  silhouettes.push_back(
      {{geometry::pinhole_from_fov(100, 75, 0.5), geometry::look_at({-2, 0, 0}, {0, 0, 0})},
       silhouettes[0].pixels});
  EXPECT_GT(expect_reference(silhouettes, view), 100);
}

}  // namespace
}  // namespace fivepipe::hull
