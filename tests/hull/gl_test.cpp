// Backend `gl`: its pass in double, its limits, its buffers and its texture. backends_test.cpp
// compares its depth with the reference.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/gl/gl_error.h"
#include "common/hull/gl/gl_hull_shaders.h"
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

// Four cameras around three capsules: the usual case, with few pixel borders per ray.
struct UsualScene {
  std::vector<Silhouette> silhouettes;
  View view;
};
UsualScene usual_scene(std::uint64_t seed) {
  Random random(seed);
  const auto object = random_object(random, 3);
  return {silhouettes_of(object, random_cameras(random, 4, 640, 480)),
          {random_camera(random, 160, 121, 0.8), 0.05, 5.0}};
}

// The contents of the storage buffer bound at `binding`.
template <class T>
std::vector<T> bound_buffer(GLuint binding) {
  GLint buffer = 0;
  glGetIntegeri_v(GL_SHADER_STORAGE_BUFFER_BINDING, binding, &buffer);
  GLint64 bytes = 0;
  glGetNamedBufferParameteri64v(GLuint(buffer), GL_BUFFER_SIZE, &bytes);
  std::vector<T> contents(std::size_t(bytes) / sizeof(T));
  glGetNamedBufferSubData(GLuint(buffer), 0, GLsizeiptr(contents.size() * sizeof(T)),
                          contents.data());
  return contents;
}

// Tighter or wider margins change these numbers: the rays that float leaves to double, the tiles
// that the first pass does not find empty, and how closely the ranges of tiles enclose the hull.
TEST_F(GlHullTest, FloatDecidesNearlyAllRaysOfTilesAroundTheHull) {
  std::size_t in_double = 0, traced = 0, tiles = 0, hits = 0, tiles_with_hits = 0;
  double before_m = 0, after_m = 0;
  for (int seed = 1; seed <= 8; ++seed) {
    const UsualScene scene = usual_scene(std::uint64_t(seed));
    hull().set_silhouettes(scene.silhouettes);
    const DepthTile depth = depth_of(hull(), whole_image(scene.view.camera), scene.view);
    const auto ranges = bound_buffer<gl_hull::Tile>(2);
    const GlHull::Counts counts = hull().counts();
    ASSERT_LE(counts.traced_tiles, ranges.size());
    std::size_t hits_in_tiles = 0;
    for (std::size_t i = 0; i < counts.traced_tiles; ++i) {
      const gl_hull::Tile& tile = ranges[i];
      const int u = int(tile.corner & 0xffff), v = int(tile.corner >> 16);
      const std::size_t hits_before = hits_in_tiles;
      for (int k = 0; k < 64; ++k) {
        if (v + k / 8 >= 121) continue;
        const double hit = depth.depth_m[std::size_t((v + k / 8) * 160 + u + k % 8)];
        if (hit == kNoHull) continue;
        ++hits_in_tiles;
        ASSERT_GE(hit, tile.begin_m * (1 - 1e-6));
        ASSERT_LE(hit, (tile.begin_m + double(tile.length_m)) * (1 + 1e-6));
        before_m += hit - tile.begin_m, after_m += tile.begin_m + double(tile.length_m) - hit;
      }
      tiles_with_hits += hits_in_tiles > hits_before;
    }
    ASSERT_EQ(hits_in_tiles, std::size_t(std::count_if(depth.depth_m.begin(), depth.depth_m.end(),
                                                       [](float d) { return d != kNoHull; })));
    hits += hits_in_tiles;
    in_double += counts.rays_in_double, traced += counts.traced_tiles, tiles += counts.tiles;
  }
  EXPECT_EQ(tiles, 8u * 20 * 16);
  EXPECT_EQ(tiles_with_hits, 791u);
  EXPECT_NEAR(double(traced), 941, 10);
  // llvmpipe's order of roundings differs between instruction sets.
  EXPECT_NEAR(double(in_double), 413, 35);
  EXPECT_NEAR(before_m / double(hits), 0.0269, 0.0003);
  EXPECT_NEAR(after_m / double(hits), 0.1546, 0.001);
}

TEST_F(GlHullTest, CountsTheTilesOfTheRects) {
  GlHull fresh;
  for (const std::size_t count :
       {fresh.counts().tiles, fresh.counts().traced_tiles, fresh.counts().rays_in_double})
    EXPECT_EQ(count, 0u);
  const UsualScene scene = usual_scene(1);
  hull().set_silhouettes(scene.silhouettes);
  const auto tiles = [&](const std::vector<PixelRect>& rects) {
    hull().trace(scene.view, rects);
    EXPECT_LE(hull().counts().traced_tiles, hull().counts().tiles);
    return hull().counts().tiles;
  };
  EXPECT_EQ(tiles({{0, 0, 8, 8}}), 1u);
  EXPECT_EQ(tiles({{7, 7, 9, 9}}), 4u);
  EXPECT_EQ(tiles({{3, 5, 70, 20}, {80, 20, 81, 121}}), 9u * 3 + 14);
  EXPECT_EQ(tiles({}), 0u);
  EXPECT_EQ(hull().counts().traced_tiles, 0u);
}

// One bit per pixel or cell. Everything outside is empty.
struct BitGrid {
  int words, rows;
  std::vector<bool> bits = std::vector<bool>(std::size_t(32 * words * rows), false);
  bool at(int u, int v) const {
    return u >= 0 && v >= 0 && u < 32 * words && v < rows && bits[std::size_t(v * 32 * words + u)];
  }
  bool any(const PixelRect& rect) const {
    for (int v = rect.v0_px; v < rect.v1_px; ++v)
      for (int u = rect.u0_px; u < rect.u1_px; ++u)
        if (at(u, v)) return true;
    return false;
  }
  // Bit 3: set; bits 0 to 2: chessboard distance to the nearest bit of the other kind, at most 7.
  unsigned code(int u, int v) const {
    const bool set = at(u, v);
    for (int d = 1; d < 7; ++d)
      for (int dv = -d; dv <= d; ++dv)
        for (int du = -d; du <= d; du += std::abs(dv) == d ? 1 : 2 * d)
          if (at(u + du, v + dv) != set) return unsigned(set ? 8 + d : d);
    return set ? 15 : 7;
  }
};

// The crops of the object pixels and their cells, as gl_hull_shaders.h describes them: in the order
// of the shaders, pixels and cells of each map.
std::vector<BitGrid> grids_of(const ObjectPixels& pixels) {
  const PixelRect b = pixels.bounds();
  const int u0 = int(std::floor((b.u0_px - 8) / 32.0)) * 32, v0 = b.v0_px - 8;
  BitGrid crop{(b.u1_px + 8 - u0 + 31) / 32, b.v1_px + 8 - v0};
  for (int v = 0; v < crop.rows; ++v)
    for (int u = 0; u < 32 * crop.words; ++u)
      crop.bits[std::size_t(v * 32 * crop.words + u)] = pixels.contains(u0 + u, v0 + v);
  BitGrid cells{(crop.words + 7) / 8, (crop.rows + 7) / 8};
  for (int v = 0; v < cells.rows; ++v)
    for (int u = 0; u < 32 * cells.words; ++u)
      cells.bits[std::size_t(v * 32 * cells.words + u)] =
          crop.any({8 * u, 8 * v, 8 * u + 8, 8 * v + 8});
  return {crop, cells};
}

// The strips of 16x8 pixels with a set cell or next to one, and all strips of the cells, have the
// distance of every pixel, and no other strip is computed.
TEST_F(GlHullTest, PreparationComputesTheDistancesNearTheObject) {
  GlHull fresh;
  for (int frame = 0; frame < 8; ++frame) {
    SCOPED_TRACE(frame);
    Random random(frame + 1);
    const int width = std::array{700, 90, 300, 33}[std::size_t(frame % 4)], height = 70 + 9 * frame;
    std::vector<Silhouette> silhouettes;
    for (const geometry::Camera& camera : random_cameras(random, 1 + frame % 3, width, height)) {
      ObjectPixels pixels = random_pixels(random, width, height, frame % 2 ? 0.0005 : 0.004);
      const int u = int(random() % unsigned(width - 30)), v = int(random() % unsigned(height - 40));
      for (int row = v; row < v + 31; ++row) pixels.set_run(u, u + 27, row);
      silhouettes.push_back({camera, pixels});
    }
    std::sort(silhouettes.begin(), silhouettes.end(), [](const Silhouette& a, const Silhouette& b) {
      return a.pixels.bounds().area_px() < b.pixels.bounds().area_px();
    });
    fresh.set_silhouettes(silhouettes);
    std::vector<BitGrid> grids;
    for (const Silhouette& s : silhouettes)
      for (BitGrid& grid : grids_of(s.pixels)) grids.push_back(std::move(grid));
    std::vector<std::array<std::uint32_t, 3>> expected;  // grid, row of strips, strip
    for (std::uint32_t g = 0; g < grids.size(); ++g)
      for (int row = 0; 8 * row < grids[g].rows; ++row)
        for (int strip = 0; strip < 2 * grids[g].words; ++strip)
          if (g % 2 || grids[g + 1].any({2 * strip - 1, row - 1, 2 * strip + 3, row + 2}))
            expected.push_back({g, std::uint32_t(row), std::uint32_t(strip)});
    const std::vector<std::uint32_t> strips = bound_buffer<std::uint32_t>(3),
                                     distances = bound_buffer<std::uint32_t>(1);
    std::vector<std::array<std::uint32_t, 3>> found;
    ASSERT_GE(strips.size(), 4 + 2 * std::size_t(strips[3]));
    for (std::uint32_t i = 0; i < strips[3]; ++i)
      found.push_back({strips[4 + 2 * i], strips[5 + 2 * i] >> 16, strips[5 + 2 * i] & 0xffff});
    std::sort(found.begin(), found.end());
    ASSERT_EQ(found, expected);
    EXPECT_EQ(strips[0], (expected.size() + 63) / 64);  // workgroups
    EXPECT_EQ(strips[1], 1u);
    EXPECT_EQ(strips[2], 1u);
    // First the pixels of all maps, then the cells of all maps.
    std::vector<std::size_t> first_word(grids.size());
    std::size_t words = 0;
    for (const std::size_t kind : {0u, 1u})
      for (std::size_t g = kind; g < grids.size(); g += 2) {
        first_word[g] = words;
        words += std::size_t(grids[g].words * grids[g].rows);
      }
    for (const auto& [g, row, strip] : expected)
      for (int v = int(8 * row); v < std::min(int(8 * row + 8), grids[g].rows); ++v)
        for (int u = int(16 * strip); u < int(16 * strip + 16); ++u) {
          const std::size_t word = 4 * (first_word[g] + std::size_t(v * grids[g].words)) + u / 8;
          ASSERT_EQ(distances[word] >> 4 * (u % 8) & 15, grids[g].code(u, v))
              << "grid " << g << ": " << u << ", " << v;
        }
  }
}

// A second trace changes only the pixels of its rects.
TEST_F(GlHullTest, TraceWritesOnlyTheRects) {
  const UsualScene scene = usual_scene(2);
  hull().set_silhouettes(scene.silhouettes);
  const PixelRect all = whole_image(scene.view.camera);
  const DepthTile before = depth_of(hull(), all, scene.view);
  const GLuint texture = hull().depth().get();
  View nearer = scene.view;  // the same rays; each that meets the hull enters it at once
  nearer.near_m = *std::max_element(before.depth_m.begin(), before.depth_m.end());
  std::vector<PixelRect> rects;
  for (int v = 3; v + 9 < 121; v += 19)
    for (int u = 5; u + 6 < 160; u += 13) rects.push_back({u, v, u + 6, v + 9});
  hull().trace(nearer, rects);
  EXPECT_EQ(hull().depth().get(), texture);
  const DepthTile after = hull().read_back(all);
  int kept = 0, changed = 0;
  for (int i = 0; i < 160 * 121; ++i) {
    const int u = i % 160, v = i / 160;
    const bool in_a_rect = std::any_of(rects.begin(), rects.end(), [&](const PixelRect& r) {
      return u >= r.u0_px && u < r.u1_px && v >= r.v0_px && v < r.v1_px;
    });
    const float was = before.depth_m[std::size_t(i)], is = after.depth_m[std::size_t(i)];
    if (!in_a_rect) {
      ASSERT_EQ(is, was) << u << ", " << v;
      kept += was != kNoHull;
    } else {
      ASSERT_TRUE(is == kNoHull || is >= float(nearer.near_m)) << u << ", " << v;
      changed += is != was;
    }
  }
  EXPECT_GT(kept, 100);
  EXPECT_GT(changed, 30);
}

TEST_F(GlHullTest, ViewsHaveAtMost16000PixelsPerSide) {
  const UsualScene scene = usual_scene(3);
  hull().set_silhouettes(scene.silhouettes);
  View view = scene.view;
  for (int geometry::Pinhole::*size :
       {&geometry::Pinhole::width_px, &geometry::Pinhole::height_px}) {
    view.camera.pinhole = scene.view.camera.pinhole;
    for (int geometry::Pinhole::*other :
         {&geometry::Pinhole::width_px, &geometry::Pinhole::height_px})
      view.camera.pinhole.*other = 1;
    view.camera.pinhole.*size = 16000;
    hull().trace(view, {});
    EXPECT_EQ(std::max(hull().depth().width_px(), hull().depth().height_px()), 16000);
    view.camera.pinhole.*size = 16001;
    EXPECT_THROW(hull().trace(view, {}), std::invalid_argument);
    view.camera.pinhole.*size = 0;
    EXPECT_THROW(hull().trace(view, {}), std::invalid_argument);
  }
}

TEST_F(GlHullTest, HasNoDepthBeforeTheFirstTrace) {
  const GlHull fresh;
  EXPECT_THROW(fresh.depth(), std::logic_error);
}

// The distances of the pixels need 16 bytes per 32 pixels.
TEST_F(GlHullTest, IsEmptyIfTheDriverHasNoRoomForTheObjectPixels) {
  GLint64 max_bytes = 0;
  glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &max_bytes);
  if (max_bytes > GLint64{1} << 28) GTEST_SKIP() << "the test would need more than 64 MiB";
  const int size = 16 + int(std::sqrt(2.0 * double(max_bytes)));
  geometry::Camera camera{{64, 64, 100, 100, 31.5, 31.5}, Eigen::Isometry3d::Identity()};
  ObjectPixels all(512, 512);
  for (int v = 0; v < 512; ++v) all.set_run(0, 512, v);
  const View view{camera, 0.5, 2.0};
  geometry::Camera large = camera;
  large.pinhole.width_px = large.pinhole.height_px = 512;
  hull().set_silhouettes(std::vector<Silhouette>{{large, all}});
  EXPECT_FALSE(no_hull(depth_of(hull(), whole_image(camera), view)));
  large.pinhole.width_px = large.pinhole.height_px = size;
  ObjectPixels corners(size, size);
  corners.set(0, 0), corners.set(size - 1, size - 1);
  EXPECT_THROW(hull().set_silhouettes(std::vector<Silhouette>{{large, corners}}), gl::GlError);
  EXPECT_TRUE(no_hull(depth_of(hull(), whole_image(camera), view)));
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
        silhouettes_of({random_cameras(random, cameras, width, height), random_object(random, 3)});
    const int view_width = int(uniform(random, 1, 70)), view_height = int(uniform(random, 1, 50));
    expect_reference(silhouettes, {random_camera(random, view_width, view_height, 0.8), 0.05, 5.0},
                     3);
  }
}

TEST_F(GlHullTest, TextureEqualsReadBack) {
  Random random(4);
  hull().set_silhouettes(silhouettes_of({random_cameras(random, 4), random_object(random, 4)}));
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

TEST_F(GlHullTest, TextureHasTheSizeOfEachView) {
  Random random(6);
  const auto silhouettes = silhouettes_of({random_cameras(random, 3), random_object(random, 3)});
  for (const auto& [width, height] : {std::pair{48, 36}, {48, 60}, {30, 60}, {30, 20}, {48, 20}}) {
    SCOPED_TRACE(width * 100 + height);
    expect_reference(silhouettes, {random_camera(random, width, height, 0.7), 0.05, 5.0}, 7);
    EXPECT_EQ(hull().depth().width_px(), width);
    EXPECT_EQ(hull().depth().height_px(), height);
  }
}

// The state that other code of the process leaves has no effect.
TEST_F(GlHullTest, ReadsBackRowsOfAnyPackAlignment) {
  const UsualScene scene = usual_scene(4);
  hull().set_silhouettes(scene.silhouettes);
  const PixelRect rect{60, 40, 99, 80};  // an odd number of floats per row
  const DepthTile expected = depth_of(hull(), rect, scene.view);
  EXPECT_FALSE(no_hull(expected));
  for (const int bytes : {1, 2, 8, 4}) {
    glPixelStorei(GL_PACK_ALIGNMENT, bytes);
    EXPECT_EQ(hull().read_back(rect).depth_m, expected.depth_m) << bytes;
  }
}

TEST_F(GlHullTest, RejectsUnsupportedInput) {
  Random random(3);
  const geometry::Camera camera = random_camera(random, 16, 12);
  const std::vector<Silhouette> silhouettes{{camera, random_pixels(random, 16, 12, 0.5)}};
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
