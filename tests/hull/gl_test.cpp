// Backend `gl`: its pass in double, its limits, its buffers and its texture. backends_test.cpp
// compares its depth with the reference.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/checked_gl_context.h"
#include "tests/support/hull/backends.h"

namespace fivepipe::hull {
namespace {

using namespace test;

// The programs are compiled once, because that takes longer than most cases.
struct GlHullTest : ::testing::Test {
  static void SetUpTestSuite() {
    context_ = new gl::GlContext;
    hull_ = new GlHull;
  }
  static void TearDownTestSuite() {
    delete hull_;
    delete context_;
  }
  void TearDown() override { expect_no_gl_error(); }
  static GlHull& hull() { return *hull_; }

  // Compares every step-th ray of the view with the reference. Returns the number of hits.
  static int expect_reference(std::span<const Silhouette> silhouettes, const View& view,
                              int step = 1) {
    hull().set_silhouettes(silhouettes);
    return test::expect_reference(depth_of(hull(), whole_image(view.camera), view), silhouettes,
                                  view, kGlTolerance, step);
  }

 private:
  static inline gl::GlContext* context_ = nullptr;
  static inline GlHull* hull_ = nullptr;
};

// With random pixels every box is small, so that many rays pass near a border.
TEST_F(GlHullTest, FloatLeavesSomeRaysOfNoiseToDouble) {
  int in_double = 0;
  for (int seed = 1; seed <= 24; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    std::vector<Silhouette> silhouettes;
    for (const geometry::Camera& camera : random_cameras(random, 3, 90, 67))
      silhouettes.push_back(
          {camera, random_pixels(random, 90, 67, std::vector{0.003, 0.05, 0.4, 0.9}[seed % 4])});
    expect_reference(silhouettes, {random_camera(random, 40, 30, 0.9), 0.01, 4.0});
    in_double += int(hull().counts().rays_in_double);
  }
  EXPECT_GT(in_double, 0);
  EXPECT_LT(in_double, 24 * 40 * 30 / 2);  // float resolves most rays
}

TEST_F(GlHullTest, LargeMapsOfLongFocalLength) {  // the largest tolerances in float
  for (const auto& [width, focal] : {std::pair{720, 50.0}, {1280, 5000.0}, {1280, 50000.0}}) {
    SCOPED_TRACE(focal);
    Random random(11);
    std::vector<Silhouette> silhouettes;
    for (int i = 0; i < 3; ++i) {
      geometry::Camera camera{{width, 480, focal, focal, 0.5 * width, 240},
                              geometry::look_at(1.5 * random_direction(random), {0, 0, 0})};
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

TEST_F(GlHullTest, RejectsMoreThan64Cameras) {
  Random random(1);
  EXPECT_THROW(
      hull().set_silhouettes(std::vector<Silhouette>(
          kMaxGlCameras + 1, {random_camera(random, 8, 8), random_pixels(random, 8, 8, 0.5)})),
      std::invalid_argument);
}

TEST_F(GlHullTest, HasNoHullBeforeSetSilhouettes) {
  Random random(3);
  const View view{random_camera(random, 16, 12), 0.5, 2.0};
  GlHull fresh;
  EXPECT_TRUE(no_hull(depth_of(fresh, whole_image(view.camera), view)));
}

// The contents that a larger frame left in the buffers must not have an effect.
TEST_F(GlHullTest, BuffersAreReusedAcrossFrames) {
  Random random(9);
  for (int frame = 0; frame < 12; ++frame) {
    SCOPED_TRACE(frame);
    const int width = int(uniform(random, 1, 200)), height = int(uniform(random, 1, 150)),
              cameras = int(uniform(random, 1, 7));
    const auto silhouettes =
        silhouettes_of(random_object(random, 3), random_cameras(random, cameras, width, height));
    expect_reference(
        silhouettes,
        {random_camera(random, int(uniform(random, 1, 70)), int(uniform(random, 1, 50)), 0.8), 0.05,
         5.0},
        3);
  }
}

TEST_F(GlHullTest, TextureEqualsReadBack) {
  Random random(4);
  hull().set_silhouettes(silhouettes_of(random_object(random, 4), random_cameras(random, 4)));
  const View view{random_camera(random, 75, 50, 0.7), 0.05, 5.0};
  const std::vector<PixelRect> rects{{3, 5, 70, 20}, {10, 20, 75, 50}};
  hull().trace(view, rects);
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
  Random random(3);
  const geometry::Camera camera = random_camera(random, 16, 12);
  const std::vector<Silhouette> silhouettes{{camera, random_pixels(random, 16, 12, 0.5)}};
  EXPECT_THROW(hull().set_silhouettes(silhouettes, {Limits::seen, 2}), std::invalid_argument);
  hull().set_silhouettes(silhouettes);
  const View view{camera, 0.1, 2};
  EXPECT_THROW(depth_of(hull(), {0, 0, 17, 12}, view), std::invalid_argument);
  EXPECT_THROW(depth_of(hull(), {-1, 0, 16, 12}, view), std::invalid_argument);
  const View no_pixel{{{0, 0, 10, 10, 0, 0}, camera.camera_from_world}, 0.1, 2};
  EXPECT_THROW(depth_of(hull(), {}, no_pixel), std::invalid_argument);
  EXPECT_TRUE(depth_of(hull(), {5, 5, 5, 9}, view).depth_m.empty());
}

}  // namespace
}  // namespace fivepipe::hull
