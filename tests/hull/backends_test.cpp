// Properties of all depth backends: `cpu`, `gl` and the plane sweep. The hard cases are in
// backend_hard_cases_test.cpp.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "tests/support/hull/backends.h"

namespace fivepipe::hull {
namespace {

using namespace test;

struct AnyHullBackend : ForHullBackends {};
struct ExactHullBackend : ForHullBackends {};
INSTANTIATE_TEST_SUITE_P(Hull, AnyHullBackend, ::testing::Values("cpu", "gl", "sweep"),
                         backend_name);
INSTANTIATE_TEST_SUITE_P(Hull, ExactHullBackend, ::testing::Values("cpu", "gl"), backend_name);

TEST_P(AnyHullBackend, TilesEqualTheWholeViewBitForBit) {
  Random random(5);
  const auto silhouettes = silhouettes_of({random_cameras(random, 4), random_object(random, 4)});
  for (int seed = 1; seed <= 10; ++seed) {
    const View view{random_camera(random, 97, 61, 0.7), 0.05, 5.0};
    const DepthTile whole = depth(silhouettes, view);
    const int u = int(uniform(random, 1, 96)), v = int(uniform(random, 1, 60));
    const std::vector<PixelRect> quarters{
        {0, 0, u, v}, {u, 0, 97, v}, {0, v, u, 61}, {u, v, 97, 61}},
        one_pixel{{u, v, u + 1, v + 1}}, two{quarters[0], quarters[3]}, one{quarters[1]};
    for (const auto& rects : {quarters, one_pixel, two, one})
      for (const DepthTile& part : backend().depth(view, rects))
        for (int y = part.rect.v0_px; y < part.rect.v1_px; ++y)
          for (int x = part.rect.u0_px; x < part.rect.u1_px; ++x)
            ASSERT_EQ(
                part.depth_m[(y - part.rect.v0_px) * part.rect.width_px() + x - part.rect.u0_px],
                whole.depth_m[y * 97 + x]);
  }
}

TEST_P(AnyHullBackend, IsBitIdenticalForEveryCameraOrder) {
  for (int seed = 1; seed <= 10; ++seed) {
    Random random(seed);
    auto silhouettes = silhouettes_of({random_cameras(random, 4), random_object(random, 3)});
    const View view{random_camera(random, 80, 60, 0.8), 0.05, 5.0};
    const auto expected = depth(silhouettes, view).depth_m;
    for (int i = 0; i < 5; ++i) {
      std::shuffle(silhouettes.begin(), silhouettes.end(), random);
      EXPECT_EQ(depth(silhouettes, view).depth_m, expected);
    }
  }
}

TEST_P(AnyHullBackend, NoCameraHasNoHull) {
  Random random(3);
  const View view{random_camera(random, 16, 12), 0.5, 2.0};
  EXPECT_TRUE(no_hull(depth({}, view)));
}

TEST_P(AnyHullBackend, NoObjectPixelInOneCameraHasNoHull) {
  Random random(3);
  const View view{random_camera(random, 16, 12), 0.5, 2.0};
  std::vector<Silhouette> silhouettes(2, {view.camera, random_pixels(random, 16, 12, 0.9)});
  EXPECT_FALSE(no_hull(depth(silhouettes, view)));
  for (const auto& pixels : {ObjectPixels(16, 12), ObjectPixels(0, 0)}) {
    silhouettes[1].pixels = pixels;
    EXPECT_TRUE(no_hull(depth(silhouettes, view)));
  }
}

TEST_P(AnyHullBackend, NotANumberHasNoHull) {
  Random random(3);
  const View view{random_camera(random, 16, 12), 0.5, 2.0};
  const std::vector<Silhouette> good(2, {view.camera, random_pixels(random, 16, 12, 0.9)});
  ASSERT_FALSE(no_hull(depth(good, view)));
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    for (double geometry::Pinhole::*field :
         {&geometry::Pinhole::fx_px, &geometry::Pinhole::cy_px}) {
      auto silhouettes = good;
      silhouettes[1].camera.pinhole.*field = bad;
      EXPECT_TRUE(no_hull(depth(silhouettes, view)));
      View bad_view = view;
      bad_view.camera.pinhole.*field = bad;
      EXPECT_TRUE(no_hull(depth(good, bad_view)));
    }
    auto silhouettes = good;
    silhouettes[0].camera.camera_from_world.translation().y() = bad;
    EXPECT_TRUE(no_hull(depth(silhouettes, view)));
    View bad_view = view;
    bad_view.camera.camera_from_world.linear()(1, 1) = bad;
    EXPECT_TRUE(no_hull(depth(good, bad_view)));
    bad_view = view;
    bad_view.camera.camera_from_world.translation().x() = bad;
    EXPECT_TRUE(no_hull(depth(good, bad_view)));
    bad_view = view;
    bad_view.far_m = bad;
    EXPECT_TRUE(no_hull(depth(good, bad_view)));
  }
}

TEST_P(AnyHullBackend, EmptyDepthRangeHasNoHull) {
  Random random(3);
  const geometry::Camera camera = random_camera(random, 16, 12);
  const std::vector<Silhouette> silhouettes{{camera, random_pixels(random, 16, 12, 0.9)}};
  for (const auto& [near, far] : {std::pair{0.0, 1.0}, {-1.0, 1.0}, {2.0, 1.0}, {1.0, 1.0}})
    EXPECT_TRUE(no_hull(depth(silhouettes, {camera, near, far})));
}

TEST_P(ExactHullBackend, EqualsTheReferenceOnRandomRigs) {
  int hits = 0;
  for (int seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const auto cameras = random_cameras(random, 1 + seed % 6);
    const auto silhouettes = silhouettes_of(random_object(random, 3), cameras,
                                            seed % 2 ? PixelRule::touched : PixelRule::center);
    hits += expect_reference(silhouettes, {random_camera(random, 64, 48, 0.8), 0.05, 5.0}, 2);
  }
  EXPECT_GT(hits, 2000);
}

// With random pixels every uniform box is small and every cell mixed.
TEST_P(ExactHullBackend, EqualsTheReferenceOnRandomNoise) {
  for (int seed = 1; seed <= 24; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    std::vector<Silhouette> silhouettes;
    for (const geometry::Camera& camera : random_cameras(random, 3, 90, 67))
      silhouettes.push_back(
          {camera, random_pixels(random, 90, 67, std::vector{0.003, 0.05, 0.4, 0.9}[seed % 4])});
    expect_reference(silhouettes, {random_camera(random, 40, 30, 0.9), 0.01, 4.0});
  }
}

TEST_P(ExactHullBackend, SaltAndPepperNoiseOfOnePercentInEveryMap) {
  Random random(77);
  auto silhouettes = silhouettes_of({random_cameras(random, 4), random_object(random, 4)});
  for (Silhouette& s : silhouettes)
    for (int i = 0; i < s.pixels.width_px() * s.pixels.height_px() / 100; ++i) {
      const int u = int(uniform(random, 0, s.pixels.width_px())),
                v = int(uniform(random, 0, s.pixels.height_px()));
      s.pixels.set(u, v, !s.pixels.contains(u, v));
    }
  EXPECT_GT(expect_reference(silhouettes, {random_camera(random, 80, 60, 0.9), 0.05, 4.0}, 3), 50);
}

TEST_P(ExactHullBackend, AnotherCameraNeverAddsVolume) {
  for (int seed = 1; seed <= 10; ++seed) {
    Random random(seed);
    const auto silhouettes = silhouettes_of({random_cameras(random, 5), random_object(random, 3)});
    const View view{random_camera(random, 80, 60, 0.8), 0.05, 5.0};
    auto before = depth(std::span(silhouettes).first(1), view).depth_m;
    for (std::size_t n = 2; n <= silhouettes.size(); ++n) {
      const auto now = depth(std::span(silhouettes).first(n), view).depth_m;
      const DepthTolerance tolerance = backend().tolerance();
      for (std::size_t i = 0; i < now.size(); ++i)
        EXPECT_TRUE(
            now[i] == kNoHull ||
            (before[i] != kNoHull && (now[i] >= before[i] || tolerance.near(now[i], before[i]))))
            << n << " cameras, ray " << i;
      before = now;
    }
  }
}

TEST_P(ExactHullBackend, ContainsTheObjectWhereMapsAreTouched) {
  for (int seed = 1; seed <= 10; ++seed) {
    Random random(seed);
    const auto object = random_object(random, 3, 0.1);
    const auto silhouettes = silhouettes_of(object, random_cameras(random, 4));
    const View view{random_camera(random, 80, 60, 0.8), 0.02, 5.0};
    const DepthTile tile = depth(silhouettes, view);
    for (int i = 0; i < 80 * 60; ++i) {
      const geometry::Ray ray = geometry::ray_through(view.camera, Eigen::Vector2d(i % 80, i / 80));
      for (const Capsule& c : object) {
        const auto surface = ray_entry(c, ray);
        // Skip the surface points that are not in the image of every camera.
        if (!surface || *surface < view.near_m ||
            !in_hull(silhouettes, ray.origin_world_m + *surface * ray.direction_world))
          continue;
        EXPECT_TRUE(
            tile.depth_m[i] != kNoHull &&
            (tile.depth_m[i] <= *surface || backend().tolerance().near(tile.depth_m[i], *surface)));
      }
    }
  }
}

TEST_P(ExactHullBackend, ManyCameras) {
  for (const int cameras : {1, 2, 3, 4, 5, 16, 17, 64}) {
    SCOPED_TRACE(cameras);
    Random random(cameras);
    const auto silhouettes =
        silhouettes_of({random_cameras(random, cameras, 100, 75), random_object(random, 3, 0.1)});
    EXPECT_GT(expect_reference(silhouettes, {random_camera(random, 64, 48, 0.6), 0.05, 4.0},
                               cameras > 16 ? 7 : 3),
              3);
  }
}

}  // namespace
}  // namespace fivepipe::hull
