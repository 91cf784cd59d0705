// Backend `gl` against the reference: on random rigs and noise, on the hard cases of cameras, maps
// and views, and in what it promises of rects, buffers and the texture.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/gl/context.h"
#include "common/hull/gl/gl_hull.h"
#include "common/hull/oracle/reference.h"
#include "tests/support/hull_scenes.h"

namespace fivepipe::hull {
namespace {

using namespace test;
using Eigen::Vector3d;

// Hull pieces along a ray shorter than this are ties of pixel borders: rounding of double decides
// whether they exist.
constexpr double kTie_m = 1e-9;
constexpr double kAgree =
    2e-6;  // of the depth: what consumers are promised; float's own rounding is 6e-8

bool near_to(float depth_m, double reference_m) {
  return std::abs(depth_m - reference_m) <= kAgree * reference_m;
}

// A ray's answers agree: same hit, same depth; a piece no longer than a tie may be found or not.
::testing::AssertionResult agree(float depth_m, const std::vector<Interval>& reference) {
  auto first = reference.begin();
  for (; first != reference.end() && first->leave - first->enter <= kTie_m; ++first)
    if (depth_m != kNoHull && near_to(depth_m, first->enter)) return ::testing::AssertionSuccess();
  if (first == reference.end() ? depth_m == kNoHull : near_to(depth_m, first->enter))
    return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure()
         << "depth " << depth_m << " m, reference "
         << (first == reference.end() ? std::string("none") : std::to_string(first->enter));
}

bool no_hull(const DepthTile& tile) {
  return std::all_of(tile.depth_m.begin(), tile.depth_m.end(),
                     [](float d) { return d == kNoHull; });
}

// Programs are made once: compiling them takes longer than most of the cases.
struct GlHullTest : ::testing::Test {
  static void SetUpTestSuite() {
    context_ = new gl::GlContext;
    hull_ = new GlHull;
  }
  static void TearDownTestSuite() {
    delete hull_;
    delete context_;
  }
  static GlHull& hull() { return *hull_; }

  // Every step-th ray of the view; returns how many hit.
  static int expect_reference(std::span<const Silhouette> silhouettes, const View& view,
                              int step = 1) {
    hull().set_silhouettes(silhouettes);
    const PixelRect rect = test::whole_image(view.camera);
    const DepthTile tile = hull().depth(view, rect);
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

 private:
  static inline gl::GlContext* context_ = nullptr;
  static inline GlHull* hull_ = nullptr;
};

TEST_F(GlHullTest, EqualsTheReferenceOnRandomRigs) {
  int hits = 0;
  for (int seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE(seed);
    test::Random random(seed);
    const auto cameras = test::random_cameras(random, 1 + seed % 6);
    const auto silhouettes = test::silhouettes_of(
        test::random_object(random, 3), cameras, seed % 2 ? PixelRule::touched : PixelRule::center);
    hits += expect_reference(silhouettes, {test::random_camera(random, 64, 48, 0.8), 0.05, 5.0}, 2);
  }
  EXPECT_GT(hits, 2000);
}

TEST_F(GlHullTest, EqualsTheReferenceOnRandomNoise) {  // pixels at random: every box is small,
                                                       // every border may part
  int in_double = 0;
  for (int seed = 1; seed <= 24; ++seed) {
    SCOPED_TRACE(seed);
    test::Random random(seed);
    std::vector<Silhouette> silhouettes;
    for (const geometry::Camera& camera : test::random_cameras(random, 3, 90, 67))
      silhouettes.push_back(
          {camera,
           test::random_pixels(random, 90, 67, std::vector{0.003, 0.05, 0.4, 0.9}[seed % 4])});
    expect_reference(silhouettes, {test::random_camera(random, 40, 30, 0.9), 0.01, 4.0});
    in_double += int(hull().counts().rays_in_double);
  }
  EXPECT_GT(in_double, 0);
  EXPECT_LT(in_double, 24 * 40 * 30 / 2);  // float settles most
}

TEST_F(GlHullTest, LargeMapsOfLongFocalLength) {  // the widest tolerances that float still settles
  for (const auto& [width, focal] : {std::pair{720, 50.0}, {1280, 5000.0}, {1280, 50000.0}}) {
    SCOPED_TRACE(focal);
    test::Random random(11);
    std::vector<Silhouette> silhouettes;
    for (int i = 0; i < 3; ++i) {
      geometry::Camera camera{{width, 480, focal, focal, 0.5 * width, 240},
                              geometry::look_at(1.5 * test::random_direction(random), {0, 0, 0})};
      ObjectPixels pixels(width, 480);
      for (int v = 60; v < 420; ++v)
        for (int u = width / 4; u < 3 * width / 4; ++u)
          if ((u / 9 + v / 7) % 5) pixels.set(u, v);
      silhouettes.push_back({camera, pixels});
    }
    View view{{geometry::pinhole_from_fov(48, 36, std::min(1.0, 1.5 * width / focal)),
               geometry::look_at({-0.4, -1.1, 0.5}, {0, 0, 0})},
              0.05,
              4.0};
    EXPECT_GT(expect_reference(silhouettes, view), 100);
  }
}

TEST_F(GlHullTest, ManyCameras) {
  for (const int cameras : {1, 2, 3, 4, 5, 16, 17, 64}) {
    SCOPED_TRACE(cameras);
    test::Random random(cameras);
    const auto silhouettes = test::silhouettes_of(test::random_object(random, 3, 0.1),
                                                  test::random_cameras(random, cameras, 100, 75));
    EXPECT_GT(expect_reference(silhouettes, {test::random_camera(random, 64, 48, 0.6), 0.05, 4.0},
                               cameras > 16 ? 7 : 3),
              3);
  }
  test::Random random(1);
  EXPECT_THROW(hull().set_silhouettes(std::vector<Silhouette>(
                   kMaxGlCameras + 1,
                   {test::random_camera(random, 8, 8), test::random_pixels(random, 8, 8, 0.5)})),
               std::invalid_argument);
}

TEST_F(GlHullTest, IsBitIdenticalForEveryCameraOrder) {
  for (int seed = 1; seed <= 5; ++seed) {
    test::Random random(seed);
    auto silhouettes =
        test::silhouettes_of(test::random_object(random, 3), test::random_cameras(random, 4));
    const View view{test::random_camera(random, 80, 60, 0.8), 0.05, 5.0};
    hull().set_silhouettes(silhouettes);
    const auto expected = hull().depth(view, test::whole_image(view.camera)).depth_m;
    for (int i = 0; i < 3; ++i) {
      std::shuffle(silhouettes.begin(), silhouettes.end(), random);
      hull().set_silhouettes(silhouettes);
      EXPECT_EQ(hull().depth(view, test::whole_image(view.camera)).depth_m, expected);
    }
  }
}

TEST_F(GlHullTest, TilesEqualTheWholeViewBitForBit) {
  test::Random random(5);
  hull().set_silhouettes(
      test::silhouettes_of(test::random_object(random, 4), test::random_cameras(random, 4)));
  for (int seed = 1; seed <= 10; ++seed) {
    const View view{test::random_camera(random, 97, 61, 0.7), 0.05, 5.0};
    const DepthTile whole = hull().depth(view, test::whole_image(view.camera));
    const int u = int(test::uniform(random, 1, 96)), v = int(test::uniform(random, 1, 60));
    const std::vector<PixelRect> parts{{0, 0, u, v}, {u, 0, 97, v}, {0, v, u, 61}, {u, v, 97, 61}},
        one{{u, v, u + 1, v + 1}}, two{parts[0], parts[3]};
    for (const auto& rects : {parts, one, two})
      for (const DepthTile& part : hull().depth(view, rects))
        for (int y = part.rect.v0_px; y < part.rect.v1_px; ++y)
          for (int x = part.rect.u0_px; x < part.rect.u1_px; ++x)
            ASSERT_EQ(
                part.depth_m[(y - part.rect.v0_px) * part.rect.width_px() + x - part.rect.u0_px],
                whole.depth_m[y * 97 + x]);
  }
}

TEST_F(GlHullTest, BuffersAreReusedAcrossFrames) {  // what a larger frame left behind never shows
  test::Random random(9);
  for (int frame = 0; frame < 12; ++frame) {
    SCOPED_TRACE(frame);
    const int width = int(test::uniform(random, 1, 200)),
              height = int(test::uniform(random, 1, 150)),
              cameras = int(test::uniform(random, 1, 7));
    const auto silhouettes = test::silhouettes_of(
        test::random_object(random, 3), test::random_cameras(random, cameras, width, height));
    expect_reference(silhouettes,
                     {test::random_camera(random, int(test::uniform(random, 1, 70)),
                                          int(test::uniform(random, 1, 50)), 0.8),
                      0.05, 5.0},
                     3);
  }
}

TEST_F(GlHullTest, TextureEqualsReadBack) {
  test::Random random(4);
  hull().set_silhouettes(
      test::silhouettes_of(test::random_object(random, 4), test::random_cameras(random, 4)));
  const View view{test::random_camera(random, 75, 50, 0.7), 0.05, 5.0};
  const std::vector<PixelRect> rects{{3, 5, 70, 20}, {10, 20, 75, 50}};
  hull().trace(view, rects);
  EXPECT_GT(hull().prepare_ms(), 0);
  EXPECT_GT(hull().trace_ms(), 0);
  EXPECT_GT(hull().counts().traced_tiles, 0u);
  const gl::GlTexture& texture = hull().depth();
  ASSERT_EQ(texture.width_px(), 75);
  ASSERT_EQ(texture.height_px(), 50);
  std::vector<float> all(75 * 50);
  glGetTextureImage(texture.get(), 0, GL_RED, GL_FLOAT, GLsizei(all.size() * sizeof(float)),
                    all.data());
  int hits = 0;
  for (const PixelRect& rect : rects) {
    const DepthTile tile = hull().read_back(rect);
    for (int i = 0; i < int(tile.depth_m.size()); ++i) {
      ASSERT_EQ(tile.depth_m[i],
                all[(rect.v0_px + i / rect.width_px()) * 75 + rect.u0_px + i % rect.width_px()]);
      hits += tile.depth_m[i] != kNoHull;
    }
  }
  EXPECT_GT(hits, 100);
}

TEST_F(GlHullTest, RejectsUnsupportedInput) {
  test::Random random(3);
  const geometry::Camera camera = test::random_camera(random, 16, 12);
  const std::vector<Silhouette> silhouettes{{camera, test::random_pixels(random, 16, 12, 0.5)}};
  EXPECT_THROW(hull().set_silhouettes(silhouettes, {Limits::seen, 2}), std::invalid_argument);
  hull().set_silhouettes(silhouettes);
  EXPECT_THROW(hull().depth({camera, 0.1, 2}, {0, 0, 17, 12}), std::invalid_argument);
  EXPECT_THROW(hull().depth({camera, 0.1, 2}, {-1, 0, 16, 12}), std::invalid_argument);
  EXPECT_THROW(
      hull().depth({{{0, 0, 10, 10, 0, 0}, camera.camera_from_world}, 0.1, 2}, PixelRect()),
      std::invalid_argument);
  EXPECT_TRUE(hull().depth({camera, 0.1, 2}, {5, 5, 5, 9}).depth_m.empty());
}

TEST_F(GlHullTest, NoCameraNoObjectPixelOrNotANumberHasNoHull) {
  test::Random random(3);
  const View view{test::random_camera(random, 16, 12), 0.5, 2.0};
  std::vector<Silhouette> silhouettes(2, {view.camera, test::random_pixels(random, 16, 12, 0.9)});
  const auto empty = [&](const View& seen) {
    return no_hull(hull().depth(seen, test::whole_image(seen.camera)));
  };
  EXPECT_TRUE(no_hull(GlHull().depth(view, test::whole_image(view.camera))));  // none set yet
  hull().set_silhouettes(silhouettes);
  EXPECT_FALSE(empty(view));
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    View broken = view;
    broken.camera.pinhole.fx_px = bad;
    EXPECT_TRUE(empty(broken));
    broken = view;
    broken.camera.camera_from_world.translation().x() = bad;
    EXPECT_TRUE(empty(broken));
    broken = view;
    broken.far_m = bad;
    EXPECT_TRUE(empty(broken));
  }
  for (const auto& [near, far] : {std::pair{0.0, 1.0}, {-1.0, 1.0}, {2.0, 1.0}, {1.0, 1.0}})
    EXPECT_TRUE(empty({view.camera, near, far}));
  for (const auto& pixels : {ObjectPixels(16, 12), ObjectPixels(0, 0)}) {
    silhouettes[1].pixels = pixels;
    hull().set_silhouettes(silhouettes);
    EXPECT_TRUE(empty(view));
  }
  silhouettes[1] = silhouettes[0];
  silhouettes[1].camera.camera_from_world.translation().x() = NAN;
  hull().set_silhouettes(silhouettes);
  EXPECT_TRUE(empty(view));
  hull().set_silhouettes({});
  EXPECT_TRUE(empty(view));
}

// --- hard cases
// ------------------------------------------------------------------------------------------------

struct GlHullSquare
    : GlHullTest {  // two cameras at right angles, 2 m from the origin; a view from a third side
  std::vector<Silhouette> silhouettes;
  View view{
      {geometry::pinhole_from_fov(64, 48, 0.5), geometry::look_at({-0.3, -2, 0.4}, {0, 0, 0})},
      0.05,
      10.0};
  GlHullSquare() {
    for (const Vector3d& eye : {Vector3d(2, 0, 0), Vector3d(0, 2, 0)})
      silhouettes.push_back(
          {{geometry::pinhole_from_fov(100, 75, 0.5), geometry::look_at(eye, {0, 0, 0})},
           ObjectPixels(100, 75)});
  }
  void fill(int camera, const PixelRect& r) {
    for (int v = r.v0_px; v < r.v1_px; ++v)
      for (int u = r.u0_px; u < r.u1_px; ++u) silhouettes[camera].pixels.set(u, v);
  }
  void fill_both(const PixelRect& r) {
    fill(0, r);
    fill(1, r);
  }
};

TEST_F(GlHullSquare, AllPixelsObjectPixels) {
  fill_both({0, 0, 100, 75});
  EXPECT_GT(expect_reference(silhouettes, view), 500);
}
TEST_F(GlHullSquare, OneObjectPixel) {
  fill_both({50, 37, 51, 38});
  view.camera.pinhole = geometry::pinhole_from_fov(320, 240, 0.1);
  EXPECT_GT(expect_reference(silhouettes, view), 10);
}
TEST_F(GlHullSquare, MapOfOnePixel) {
  silhouettes[0] = {
      {geometry::pinhole_from_fov(1, 1, 0.2), silhouettes[0].camera.camera_from_world},
      ObjectPixels(1, 1)};
  fill(0, {0, 0, 1, 1});
  fill(1, {20, 20, 70, 60});
  EXPECT_GT(expect_reference(silhouettes, view), 50);
}
TEST_F(GlHullSquare, MapsWhoseWidthIsNoMultipleOfEightOr64) {
  test::Random random(3);
  for (const int width : {7, 9, 63, 64, 65, 127, 129}) {
    SCOPED_TRACE(width);
    for (int i = 0; i < 2; ++i)
      silhouettes[i] = {
          {geometry::pinhole_from_fov(width, 33, 0.5), silhouettes[i].camera.camera_from_world},
          test::random_pixels(random, width, 33, 0.3)};
    EXPECT_GT(expect_reference(silhouettes, view, 3), 0);
  }
}
TEST_F(GlHullSquare, ObjectCutByTheImageBorder) {
  fill(0, {80, 0, 100, 40});
  fill(1, {40, 0, 100, 75});
  EXPECT_GT(expect_reference(silhouettes, view), 20);
}
TEST_F(GlHullSquare, EyeInsideTheHullAndNearPlaneInside) {
  fill_both({30, 20, 70, 55});
  view.camera = {geometry::pinhole_from_fov(64, 48, 1.5),
                 geometry::look_at({0.02, -0.01, 0.03}, {1, 1, 0.2})};
  hull().set_silhouettes(silhouettes);
  const DepthTile tile = hull().depth(view, test::whole_image(view.camera));
  for (const float d : tile.depth_m) ASSERT_EQ(d, float(view.near_m));
  view = {{geometry::pinhole_from_fov(64, 48, 0.5), geometry::look_at({-0.3, -2, 0.4}, {0, 0, 0})},
          2.0,
          10.0};
  EXPECT_GT(expect_reference(silhouettes, view), 50);
}
TEST_F(GlHullSquare, EyeAtACamerasCentre) {
  fill(0, {10, 10, 90, 70});
  fill(1, {33, 20, 60, 55});
  view.camera.camera_from_world = silhouettes[0].camera.camera_from_world;
  EXPECT_GT(expect_reference(silhouettes, view), 50);
  view.camera = silhouettes[0].camera;  // each ray one map pixel, at its centre
  EXPECT_GT(expect_reference(silhouettes, view), 50);
}
TEST_F(GlHullSquare, CameraInTheViewAndRaysThroughItsCentre) {
  fill_both({10, 10, 90, 70});
  for (const Vector3d& eye : {Vector3d(3, 0, 0), Vector3d(2, 0, 0), Vector3d(3, 0.25, 0.125)}) {
    view.camera.camera_from_world =
        geometry::look_at(eye, eye.y() == 0 ? Vector3d(0, 0, 0) : Vector3d(2, 0, 0));
    view.camera.pinhole = {65,  49, 100,
                           100, 32, 24};  // the middle ray goes exactly through the centre
    EXPECT_GT(expect_reference(silhouettes, view), 100);
  }
}
TEST_F(GlHullSquare, DepthOfACameraCrossesZeroAlongTheRay) {
  fill_both({0, 0, 100, 75});
  test::Random random(8);
  for (int i = 0; i < 30; ++i) {
    view.camera = {
        geometry::pinhole_from_fov(40, 30, 1.5),
        geometry::look_at(Vector3d(2, 0, 0) + test::random_in_ball(random, 0.5),
                          test::random_in_ball(random, 1.0), test::random_direction(random))};
    expect_reference(silhouettes, view, 3);
  }
}
TEST_F(GlHullSquare, ImageOfRaysAlongPixelEdges) {  // the view shares a camera's axes: epipolar
                                                    // lines run along rows, on edges and centres
  fill_both({20, 20, 80, 60});
  silhouettes[0].camera.pinhole = {100, 75, 128, 128, 49.5, 37};
  view.camera = silhouettes[0].camera;
  view.camera.camera_from_world.translation() += Vector3d(0.25, 0, 0);
  for (const double cy : {37.0, 36.5}) {
    view.camera.pinhole = {100, 75, 128, 128, 49.5, cy};
    hull().set_silhouettes(silhouettes);
    for (const float d : hull().depth(view, test::whole_image(view.camera)).depth_m)
      EXPECT_TRUE(d == kNoHull || (d >= view.near_m && d < view.far_m));
    if (cy == 37.0) {
      EXPECT_GT(expect_reference(silhouettes, view), 500);
    }
  }
}
TEST_F(GlHullSquare, HullThinnerThanAPixelOfTheView) {
  fill(0, {50, 0, 51, 75});
  fill(1, {0, 37, 100, 38});
  view.camera.pinhole = geometry::pinhole_from_fov(30, 20, 0.9);
  expect_reference(silhouettes, view);
}
TEST_F(GlHullSquare, GhostVolumesAndPartsBehindEachOther) {
  for (int i = 0; i < 2; ++i) {
    fill(i, {20, 20, 35, 60});
    fill(i, {65, 20, 80, 60});
  }
  EXPECT_GT(expect_reference(silhouettes, view), 50);
}
TEST_F(GlHullSquare, HullTouchingTheNearOrFarPlane) {
  fill_both({20, 20, 80, 60});
  hull().set_silhouettes(silhouettes);
  const auto pieces =
      reference_intervals(silhouettes, geometry::ray_through(view.camera, Eigen::Vector2d(32, 24)),
                          view.near_m, view.far_m);
  ASSERT_EQ(pieces.size(), 1u);
  const double enter = pieces[0].enter, leave = pieces[0].leave;
  const auto middle = [&](double near, double far) {
    return hull().depth({view.camera, near, far}, {32, 24, 33, 25}).depth_m[0];
  };
  EXPECT_EQ(middle(0.05, enter * (1 - 1e-9)), kNoHull);
  EXPECT_EQ(middle(0.05, enter * (1 + 1e-9)), float(enter));
  EXPECT_EQ(middle(leave * (1 + 1e-9), 10), kNoHull);
  EXPECT_EQ(middle(leave * (1 - 1e-9), 10), float(leave * (1 - 1e-9)));
}
TEST_F(GlHullSquare, TwoCamerasOfOnePoseAndOpposedCameras) {
  fill_both({20, 20, 80, 60});
  silhouettes.push_back(silhouettes[0]);
  silhouettes.push_back(
      {{geometry::pinhole_from_fov(100, 75, 0.5), geometry::look_at({-2, 0, 0}, {0, 0, 0})},
       silhouettes[0].pixels});
  EXPECT_GT(expect_reference(silhouettes, view), 100);
}
TEST_F(GlHullSquare, CameraOneKilometreAway) {
  silhouettes[0].camera.camera_from_world = geometry::look_at({1000, 0, 0}, {0, 0, 0});
  fill(0, {0, 0, 100, 75});
  fill(1, {20, 20, 80, 60});
  EXPECT_GT(expect_reference(silhouettes, view), 100);
}

}  // namespace
}  // namespace fivepipe::hull
