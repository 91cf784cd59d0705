// The depth backends with Limits::seen, on rigs whose cameras see only parts of the object: the
// hull then has faces on the borders of the images.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/hull/backends.h"
#include "tests/support/not_finite.h"

namespace fivepipe::hull {
namespace {

using namespace test;
using Eigen::Vector3d;

struct SeenBackend : ForHullBackends {
  DepthTile depth_by(const HullRule& rule, std::span<const Silhouette> silhouettes,
                     const View& view) {
    backend().set(silhouettes, rule);
    return depth_of(backend(), whole_image(view.camera), view);
  }
};
struct ExactSeenBackend : SeenBackend {};
INSTANTIATE_TEST_SUITE_P(Hull, SeenBackend, ::testing::Values("cpu", "gl", "sweep"), backend_name);
INSTANTIATE_TEST_SUITE_P(Hull, ExactSeenBackend, ::testing::Values("cpu", "gl"), backend_name);

std::vector<Silhouette> narrow_rig(Random& random, int cameras) {
  return silhouettes_of({narrow_cameras(random, cameras, 80, 61), random_object(random, 3)});
}

const Capsule kSeenBall{{0, 0, 0}, {0, 0, 0}, 0.1};

View random_view(Random& random, int width_px = 48, int height_px = 36) {
  return {random_camera(random, width_px, height_px, 0.8), 0.05, 5.0};
}

TEST_P(ExactSeenBackend, AgreesWithTheReferenceWhereCamerasSeeOnlyParts) {
  int hits = 0, differ = 0;
  for (int seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const int cameras = 1 + seed % 5;
    const auto silhouettes = narrow_rig(random, cameras);
    const View view = random_view(random);
    const auto by_all = depth_by({}, silhouettes, view).depth_m;
    for (const int min_seen : {1, 2, 3, cameras}) {
      const HullRule rule{Limits::seen, min_seen};
      const DepthTile tile = depth_by(rule, silhouettes, view);
      hits += test::expect_reference(tile, silhouettes, view, backend().tolerance(), 3, rule);
      differ += tile.depth_m != by_all;
    }
  }
  EXPECT_GT(hits, 3000);
  EXPECT_GT(differ, 40);  // the rule matters on these rigs
}

// The cameras are behind the view's rays, in them, or look along them, and the maps are noise, so
// that rays cross many borders.
TEST_P(ExactSeenBackend, AgreesWithTheReferenceInNoiseAndNextToCameras) {
  int hits = 0;
  for (int seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    std::vector<Silhouette> silhouettes;
    for (int i = 0; i < 2 + seed % 3; ++i)
      silhouettes.push_back({random_camera(random, 40, 30, seed % 2 ? 0.3 : 1.2),
                             random_pixels(random, 40, 30, seed % 4 ? 0.9 : 0.98)});
    const View view = random_view(random, 40, 30);
    for (const int min_seen : {1, 2}) {
      const HullRule rule{Limits::seen, min_seen};
      hits += test::expect_reference(depth_by(rule, silhouettes, view), silhouettes, view,
                                     backend().tolerance(), 3, rule);
    }
  }
  EXPECT_GT(hits, 500);
}

// The poses are exact, so the ray through the diagonal of the image crosses corners of pixels at
// equal parameters, where spans of the maps have no length.
TEST_P(ExactSeenBackend, ARayThroughTheCornersOfPixelsFindsNoHullBesideIt) {
  Silhouette silhouette{{{64, 64, 64, 64, 31.5, 31.5}, Eigen::Isometry3d::Identity()},
                        ObjectPixels(64, 64)};
  for (const auto& [u, v] : {std::pair{10, 50}, {50, 10}, {43, 41}}) silhouette.pixels.set(u, v);
  View view{{{3, 1, 1, 1, 1, 0}, Eigen::Isometry3d::Identity()}, 0.05, 5};
  Eigen::Matrix3d eye_from_world;  // looks along +x, with +y on its right
  eye_from_world << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  view.camera.camera_from_world.linear() = eye_from_world;
  view.camera.camera_from_world.translation() = -eye_from_world * Vector3d(-1, -1, 2);
  const HullRule rule{Limits::seen, 1};
  const DepthTile tile = depth_by(rule, {&silhouette, 1}, view);
  EXPECT_EQ(tile.depth_m, std::vector<float>(3, 0));
  test::expect_reference(tile, {&silhouette, 1}, view, backend().tolerance(), 1, rule);
}

// With all pixels object pixels, the hull is the part of space that min_seen cameras see.
TEST_P(ExactSeenBackend, ImagesOfObjectPixelsLimitNothing) {
  Random random(4);
  std::vector<Silhouette> silhouettes;
  for (const geometry::Camera& camera : narrow_cameras(random, 3, 40, 30))
    silhouettes.push_back({camera, random_pixels(random, 40, 30, 1)});
  const View view = random_view(random);
  for (const int min_seen : {1, 2, 3}) {
    const HullRule rule{Limits::seen, min_seen};
    EXPECT_GT(test::expect_reference(depth_by(rule, silhouettes, view), silhouettes, view,
                                     backend().tolerance(), 1, rule),
              20);
  }
}

TEST_P(ExactSeenBackend, ManyCameras) {
  Random random(8);
  const auto silhouettes = narrow_rig(random, 23);
  const View view = random_view(random, 32, 24);
  int hits = 0;
  for (const int min_seen : {2, 5, 9}) {
    const HullRule rule{Limits::seen, min_seen};
    hits += test::expect_reference(depth_by(rule, silhouettes, view), silhouettes, view,
                                   backend().tolerance(), 3, rule);
  }
  EXPECT_GT(hits, 50);
}

TEST_P(SeenBackend, TilesEqualTheWholeViewBitForBit) {
  Random random(5);
  const auto silhouettes = narrow_rig(random, 4);
  for (const int min_seen : {1, 2}) {
    const View view = random_view(random, 97, 61);
    const DepthTile whole = depth_by({Limits::seen, min_seen}, silhouettes, view);
    EXPECT_FALSE(no_hull(whole));
    const std::vector<PixelRect> parts{{0, 0, 30, 41}, {30, 0, 97, 41}, {0, 41, 97, 61}};
    for (const DepthTile& part : backend().depth(view, parts))
      for (int y = part.rect.v0_px; y < part.rect.v1_px; ++y)
        for (int x = part.rect.u0_px; x < part.rect.u1_px; ++x)
          ASSERT_EQ(
              part.depth_m[(y - part.rect.v0_px) * part.rect.width_px() + x - part.rect.u0_px],
              whole.depth_m[y * 97 + x]);
  }
}

TEST_P(SeenBackend, IsBitIdenticalForEveryCameraOrder) {
  Random random(6);
  auto silhouettes = narrow_rig(random, 4);
  silhouettes.push_back({random_camera(random, 40, 30), ObjectPixels(40, 30)});
  const View view = random_view(random);
  const auto expected = depth_by({Limits::seen, 2}, silhouettes, view).depth_m;
  for (int i = 0; i < 5; ++i) {
    std::shuffle(silhouettes.begin(), silhouettes.end(), random);
    EXPECT_EQ(depth_by({Limits::seen, 2}, silhouettes, view).depth_m, expected);
  }
}

TEST_P(SeenBackend, CamerasThatSeeNothingRemoveNothing) {
  Random random(7);
  auto silhouettes = silhouettes_of({kSeenBall}, random_cameras(random, 3, 80, 61));
  const View view = random_view(random);
  const auto expected = depth_by({Limits::seen, 3}, silhouettes, view).depth_m;
  EXPECT_TRUE(std::any_of(expected.begin(), expected.end(), [](float d) { return d != kNoHull; }));
  // It looks away from the ball.
  geometry::Camera away = random_camera(random, 40, 30);
  away.camera_from_world = geometry::look_at({0, 0, 1}, {0.1, 0, 2}, Vector3d::UnitX());
  silhouettes.push_back({away, ObjectPixels(40, 30)});
  EXPECT_EQ(depth_by({Limits::seen, 3}, silhouettes, view).depth_m, expected);
  EXPECT_TRUE(no_hull({whole_image(view.camera), depth_by({}, silhouettes, view).depth_m}));
  // It sees the ball, and no object pixel.
  away.camera_from_world = geometry::look_at({0, 0, 1}, {0, 0, 0}, Vector3d::UnitX());
  silhouettes.back().camera = away;
  EXPECT_TRUE(no_hull(depth_by({Limits::seen, 3}, silhouettes, view)));
}

TEST_P(SeenBackend, MoreCamerasThanTheRigHasGiveNoHull) {
  Random random(9);
  const auto silhouettes = silhouettes_of({kSeenBall}, random_cameras(random, 2, 40, 30));
  const View view = random_view(random);
  EXPECT_FALSE(no_hull(depth_by({Limits::seen, 2}, silhouettes, view)));
  EXPECT_TRUE(no_hull(depth_by({Limits::seen, 3}, silhouettes, view)));
  EXPECT_TRUE(no_hull(depth_by({Limits::seen, 1}, {}, view)));
}

TEST_P(SeenBackend, ACameraThatIsNotFiniteHasNoHull) {
  Random random(10);
  auto silhouettes = silhouettes_of({kSeenBall}, random_cameras(random, 3, 40, 30));
  const View view = random_view(random);
  for (const double value : {kNaN, kInfinity}) {
    auto broken = silhouettes;
    broken[1].camera.camera_from_world.translation().x() = value;
    EXPECT_TRUE(no_hull(depth_by({Limits::seen, 1}, broken, view)));
  }
  View broken = view;
  broken.camera.pinhole.fx_px = kNaN;
  EXPECT_TRUE(no_hull(depth_by({Limits::seen, 1}, silhouettes, broken)));
}

// A part of the hull that only one camera sees ends at the border of its image.
TEST_P(SeenBackend, ANearHullIsAtTheNearPlane) {
  Random random(11);
  const geometry::Camera camera = random_camera(random, 40, 30, 1);
  const std::vector<Silhouette> silhouettes{{camera, random_pixels(random, 40, 30, 1)}};
  View view{camera, 0.3, 2};
  view.camera.pinhole = geometry::pinhole_from_fov(60, 45, 1.5);  // wider than the camera's image
  const DepthTile tile = depth_by({Limits::seen, 1}, silhouettes, view);
  const auto at = [&](int u, int v) { return tile.depth_m[std::size_t(v) * 60 + u]; };
  EXPECT_EQ(at(30, 22), 0.3f);
  EXPECT_EQ(at(0, 0), kNoHull);
}

// The sweep keeps the first plane whose point is in the hull. Points next to a border may differ.
TEST(SeenSweep, DepthIsThatOfTheFirstPlaneInTheHull) {
  CheckedGlContext context;
  constexpr int kPlanes = 40;
  PlaneSweep sweep(48, 36, kPlanes);
  int hits = 0, same = 0, rays = 0;
  for (int seed = 1; seed <= 8; ++seed) {
    Random random(seed);
    const auto silhouettes = narrow_rig(random, 2 + seed % 3);
    const View view = random_view(random);
    const SweepRange range{0.2, 1.6};
    for (const int min_seen : {1, 2}) {
      const HullRule rule{Limits::seen, min_seen};
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
  EXPECT_GT(hits, 1000);
  EXPECT_GT(same, rays - rays / 200);
}

}  // namespace
}  // namespace fivepipe::hull
