// The plane sweep against the reference: its depth is that of the first plane in the hull.
// backends_test.cpp has the properties that all backends share.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/checked_gl_context.h"
#include "tests/support/hull/backends.h"

namespace fivepipe::hull {
namespace {

using namespace test;

// Error of texture coordinates, which are interpolated in float: about ten operations with 2^-24 of
// 1000 px. A point that is nearer to a border may count as on either side.
constexpr double kFloatRounding_px = 0.005;

struct Sweep : ::testing::Test {
  test::CheckedGlContext context;
};

// Membership of a point whose pixels may move by up to kFloatRounding_px: in the hull for all such
// moves (certainly), or for some (perhaps).
struct Membership {
  bool certainly = true, perhaps = true;
};
Membership membership(std::span<const Silhouette> silhouettes, const Eigen::Vector3d& p) {
  Membership m;
  for (const Silhouette& s : silhouettes) {
    const auto uv = geometry::project(s.camera, p);
    bool any = false, all = uv.has_value();
    for (const double du : {-kFloatRounding_px, kFloatRounding_px})
      for (const double dv : {-kFloatRounding_px, kFloatRounding_px}) {
        const bool in = uv && s.pixels.contains_at(uv->x() + du, uv->y() + dv);
        any |= in;
        all &= in;
      }
    m.certainly &= all;
    m.perhaps &= any;
  }
  return m;
}

TEST_F(Sweep, WithoutSilhouettesFindsNoHull) {
  Random random(1);
  const PlaneSweep sweep(64, 48, 16);
  const View view{random_camera(random, 64, 48, 0.8), 0.05, 5.0};
  const DepthTile tile = depth_of(sweep, whole_image(view.camera), view, SweepRange{0.2, 1.6});
  for (const float depth_m : tile.depth_m) ASSERT_EQ(depth_m, kNoHull);
}

TEST_F(Sweep, DepthIsThatOfTheFirstPlaneInTheHull) {
  constexpr int kPlanes = 40;
  PlaneSweep sweep(64, 48, kPlanes);
  int hits = 0;
  for (int seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const auto silhouettes =
        silhouettes_of({random_cameras(random, 1 + seed % 5), random_object(random, 3)});
    const View view{random_camera(random, 64, 48, 0.8), 0.05, 5.0};
    const SweepRange range{0.2, 1.6};
    sweep.set_silhouettes(silhouettes);
    const DepthTile tile = depth_of(sweep, whole_image(view.camera), view, range);
    for (int i = 0; i < 64 * 48; ++i) {
      const geometry::Ray ray = geometry::ray_through(view.camera, Eigen::Vector2d(i % 64, i / 64));
      const double index =
          (tile.depth_m[i] - range.near_m) / (range.far_m - range.near_m) * kPlanes;
      const int kept = tile.depth_m[i] == kNoHull ? kPlanes : int(std::lround(index));
      if (kept < kPlanes) {
        ++hits;
        ASSERT_NEAR(index, kept, 1e-4) << "not the depth of a plane";
        EXPECT_TRUE(membership(silhouettes,
                               ray.origin_world_m + double(tile.depth_m[i]) * ray.direction_world)
                        .perhaps)
            << i;
      }
      for (int k = 0; k < kept; ++k) {
        const double t = range.near_m + k * (range.far_m - range.near_m) / kPlanes;
        EXPECT_FALSE(
            membership(silhouettes, ray.origin_world_m + t * ray.direction_world).certainly)
            << "ray " << i << " passed plane " << k;
      }
    }
  }
  EXPECT_GT(hits, 1000);
}

TEST_F(Sweep, WithinOnePlaneSpacingOfTheReferenceWhereTheHullIsThicker) {
  constexpr int kPlanes = 128;
  PlaneSweep sweep(96, 72, kPlanes);
  const SweepRange range{0.3, 1.3};
  const double spacing_m = (range.far_m - range.near_m) / kPlanes;
  std::vector<double> errors_m;
  int wrong_hits = 0, wrong_misses = 0;
  for (int seed = 1; seed <= 5; ++seed) {
    Random random(seed);
    const auto silhouettes =
        silhouettes_of({random_cameras(random, 4), random_object(random, 3, 0.15)});
    const View view{random_camera(random, 96, 72, 0.8), range.near_m, range.far_m};
    sweep.set_silhouettes(silhouettes);
    const DepthTile tile = depth_of(sweep, whole_image(view.camera), view, range);
    for (int i = 0; i < 96 * 72; i += 3) {
      const auto pieces = reference_intervals(
          silhouettes, geometry::ray_through(view.camera, Eigen::Vector2d(i % 96, i / 96)),
          range.near_m, range.far_m);
      const bool hit = tile.depth_m[i] != kNoHull;
      wrong_hits += hit && pieces.empty();
      if (pieces.empty() || pieces[0].leave - pieces[0].enter < spacing_m)
        continue;  // the planes may miss it
      wrong_misses += !hit;
      if (hit) errors_m.push_back(tile.depth_m[i] - pieces[0].enter);
    }
  }
  ASSERT_GT(errors_m.size(), 500u);
  std::sort(errors_m.begin(), errors_m.end());
  EXPECT_LE(errors_m[errors_m.size() * 99 / 100], spacing_m);
  EXPECT_GE(errors_m[errors_m.size() / 100], -1e-6);  // not before the hull
  EXPECT_LE(wrong_hits + wrong_misses, 3);            // ties of float rounding on pixel borders
}

// The view is the map's own camera, so each ray samples the centre of one map pixel. If a
// conversion to OpenGL is shifted by half a pixel or flipped, the ray samples a different pixel.
TEST_F(Sweep, PixelCentresMeetWhereViewAndMapAreOneCamera) {
  Random random(2);
  PlaneSweep sweep(75, 52, 4);
  geometry::Camera camera = random_camera(random, 75, 52);
  camera.pinhole.cx_px += 3.25;  // not the image centre
  const std::vector<Silhouette> silhouettes{{camera, random_pixels(random, 75, 52, 0.5)}};
  sweep.set_silhouettes(silhouettes);
  const DepthTile tile =
      depth_of(sweep, whole_image(camera), View{camera, 0.5, 2.0}, SweepRange{0.5, 2.0});
  for (int v = 0; v < 52; ++v)
    for (int u = 0; u < 75; ++u)
      ASSERT_EQ(tile.depth_m[v * 75 + u], silhouettes[0].pixels.contains(u, v) ? 0.5f : kNoHull)
          << u << ", " << v;
}

// The texture's mirror image behind the camera is not drawn.
TEST_F(Sweep, NothingBehindACameraIsInTheHull) {
  PlaneSweep sweep(40, 30, 16);
  ObjectPixels all(20, 20);
  for (int i = 0; i < 400; ++i) all.set(i % 20, i / 20);
  const std::vector<Silhouette> silhouettes{
      {{geometry::pinhole_from_fov(20, 20, 1.0), geometry::look_at({0, 0, 0}, {1, 0, 0})}, all}};
  sweep.set_silhouettes(silhouettes);
  const View before{
      {geometry::pinhole_from_fov(40, 30, 1.0), geometry::look_at({1, -2, 0}, {1, 0, 0})}, 0.1, 4},
      behind{{geometry::pinhole_from_fov(40, 30, 0.4), geometry::look_at({-1, -2, 0}, {-1, 0, 0})},
             0.1,
             4};
  const DepthTile seen = depth_of(sweep, whole_image(before.camera), before, SweepRange{0.1, 4}),
                  unseen = depth_of(sweep, whole_image(behind.camera), behind, SweepRange{0.1, 4});
  EXPECT_GT(
      std::count_if(seen.depth_m.begin(), seen.depth_m.end(), [](float d) { return d != kNoHull; }),
      300);
  for (const float d : unseen.depth_m) EXPECT_EQ(d, kNoHull);
}

// The plane intersects both the camera's field of view and its mirror image.
TEST_F(Sweep, NothingBehindACameraInThePlaneIsInTheHull) {
  PlaneSweep sweep(80, 60, 3);
  ObjectPixels all(20, 20);
  for (int i = 0; i < 400; ++i) all.set(i % 20, i / 20);
  const std::vector<Silhouette> silhouettes{
      {{geometry::pinhole_from_fov(20, 20, 2.4), geometry::look_at({0, 0, 0}, {1, 0, 1})}, all}};
  sweep.set_silhouettes(silhouettes);
  const View view{
      {geometry::pinhole_from_fov(80, 60, 1.0), geometry::look_at({0, -1, 0}, {0, 0, 0})},
      0.9,
      1.2};
  const DepthTile tile = depth_of(sweep, whole_image(view.camera), view, SweepRange{0.9, 1.2});
  int hits = 0;
  for (int i = 0; i < 80 * 60; ++i) {
    if (tile.depth_m[i] == kNoHull) continue;
    ++hits;
    const geometry::Ray ray = geometry::ray_through(view.camera, Eigen::Vector2d(i % 80, i / 80));
    EXPECT_TRUE(
        membership(silhouettes, ray.origin_world_m + double(tile.depth_m[i]) * ray.direction_world)
            .perhaps)
        << i;
  }
  EXPECT_GT(hits, 500);
}

TEST_F(Sweep, RejectsMoreThan255Cameras) {
  Random random(3);
  PlaneSweep sweep(16, 12, 8);
  const geometry::Camera camera = random_camera(random, 16, 12);
  std::vector<Silhouette> silhouettes(255u, {camera, random_pixels(random, 16, 12, 0.5)});
  sweep.set_silhouettes(silhouettes);
  const DepthTile tile =
      depth_of(sweep, whole_image(camera), View{camera, 0.5, 2.0}, SweepRange{0.5, 2.0});
  for (int i = 0; i < 16 * 12; ++i)
    EXPECT_EQ(tile.depth_m[i] != kNoHull, silhouettes[0].pixels.contains(i % 16, i / 16));
  silhouettes.push_back(silhouettes[0]);
  EXPECT_THROW(sweep.set_silhouettes(silhouettes), std::invalid_argument);
}

// The sweep keeps its textures from frame to frame if their size is unchanged.
TEST_F(Sweep, MapsMayChangeTheirSizesAndTheirNumber) {
  Random random(5);
  PlaneSweep sweep(40, 30, 4);
  const geometry::Camera view = random_camera(random, 40, 30);
  for (const auto& [width, height, cameras] :
       {std::tuple{40, 30, 1}, {40, 30, 2}, {80, 30, 2}, {80, 60, 1}, {20, 60, 3}, {40, 30, 3}}) {
    SCOPED_TRACE(width * 1000 + height);
    const geometry::Camera camera{geometry::resized(view.pinhole, width, height),
                                  view.camera_from_world};
    std::vector<Silhouette> silhouettes;
    for (int c = 0; c < cameras; ++c)
      silhouettes.push_back({camera, random_pixels(random, width, height, 0.7)});
    sweep.set_silhouettes(silhouettes);
    const DepthTile tile =
        depth_of(sweep, whole_image(view), View{view, 0.5, 2.0}, SweepRange{0.5, 2.0});
    int decided = 0;
    for (int i = 0; i < 40 * 30; ++i) {
      const geometry::Ray ray = geometry::ray_through(view, Eigen::Vector2d(i % 40, i / 40));
      const Membership m = membership(silhouettes, ray.origin_world_m + 0.5 * ray.direction_world);
      if (m.certainly != m.perhaps) continue;  // a pixel border
      ++decided;
      ASSERT_EQ(tile.depth_m[i] != kNoHull, m.certainly) << i % 40 << ", " << i / 40;
    }
    EXPECT_GT(decided, 250);
  }
}

TEST_F(Sweep, RectsAndRangesWithoutHull) {
  Random random(6);
  PlaneSweep sweep(24, 20, 8);
  const geometry::Camera camera = random_camera(random, 24, 20);
  sweep.set_silhouettes(std::vector<Silhouette>{{camera, random_pixels(random, 24, 20, 0.9)}});
  const auto hits = [&](const geometry::Camera& view, const SweepRange& range,
                        const PixelRect& rect) {
    const DepthTile tile = depth_of(sweep, rect, View{view, 0.5, 2.0}, range);
    EXPECT_EQ(tile.rect, rect);
    EXPECT_EQ(tile.depth_m.size(), rect.area_px());
    return std::count_if(tile.depth_m.begin(), tile.depth_m.end(),
                         [](float d) { return d != kNoHull; });
  };
  const PixelRect all = whole_image(camera);
  EXPECT_GT(hits(camera, {0.5, 2}, all), 300);
  EXPECT_GT(hits(camera, {0.5, 2}, {3, 4, 10, 9}), 20);
  EXPECT_EQ(hits(camera, {0.5, 2}, {3, 4, 3, 9}), 0);
  for (const SweepRange& range :
       {SweepRange{0, 2}, {-1, 2}, {2, 2}, {2, 0.5}, {0.5, INFINITY}, {0.5, NAN}, {NAN, 2}})
    EXPECT_EQ(hits(camera, range, all), 0) << range.near_m << ", " << range.far_m;
  geometry::Camera not_finite = camera;
  not_finite.pinhole.cx_px = NAN;
  EXPECT_EQ(hits(not_finite, {0.5, 2}, all), 0);
  geometry::Camera also = camera;
  const ObjectPixels nothing(24, 20), some = random_pixels(random, 24, 20, 0.9);
  sweep.set_silhouettes(std::vector<Silhouette>{{camera, some}, {camera, nothing}});
  EXPECT_EQ(hits(camera, {0.5, 2}, all), 0);
  also.pinhole.fx_px = NAN;
  sweep.set_silhouettes(std::vector<Silhouette>{{camera, some}, {also, some}});
  EXPECT_EQ(hits(camera, {0.5, 2}, all), 0);
  sweep.set_silhouettes(std::vector<Silhouette>{{camera, some}});
  EXPECT_GT(hits(camera, {0.5, 2}, all), 300);
}

// The first plane is at the start of the range, whichever way that is rounded.
TEST_F(Sweep, FirstPlaneIsDrawnAtAnyDepth) {
  PlaneSweep sweep(16, 12, 3);
  Random random(9);
  const geometry::Camera camera = random_camera(random, 16, 12);
  ObjectPixels all(16, 12);
  for (int v = 0; v < 12; ++v) all.set_run(0, 16, v);
  sweep.set_silhouettes(std::vector<Silhouette>{{camera, all}});
  for (int i = 0; i < 60; ++i) {
    const double near_m = uniform(random, 0.05, 3), far_m = near_m + uniform(random, 0.1, 9);
    const DepthTile tile = depth_of(sweep, whole_image(camera), View{camera, near_m, far_m},
                                    SweepRange{near_m, far_m});
    for (const float depth_m : tile.depth_m) ASSERT_EQ(depth_m, float(near_m)) << near_m;
  }
}

// The depth function and the alignment of rows that other code of the process leaves have no
// effect.
TEST_F(Sweep, SetsTheDepthFunctionAndThePackAlignment) {
  Random random(10);
  PlaneSweep sweep(25, 20, 8);
  const geometry::Camera camera = random_camera(random, 25, 20);
  sweep.set_silhouettes(std::vector<Silhouette>{{camera, random_pixels(random, 25, 20, 0.7)}});
  const View view{camera, 0.5, 2.0};
  const SweepRange range{0.5, 2.0};
  const DepthTile expected = depth_of(sweep, whole_image(camera), view, range);
  EXPECT_FALSE(no_hull(expected));
  for (const GLenum function : {GL_ALWAYS, GL_GREATER, GL_NEVER})
    for (const int bytes : {1, 8}) {
      glDepthFunc(function);
      glPixelStorei(GL_PACK_ALIGNMENT, bytes);
      EXPECT_EQ(depth_of(sweep, whole_image(camera), view, range).depth_m, expected.depth_m)
          << function << ", " << bytes;
    }
}

TEST_F(Sweep, LeavesItsTestsDisabled) {
  Random random(7);
  PlaneSweep sweep(24, 20, 8);
  const geometry::Camera camera = random_camera(random, 24, 20);
  sweep.set_silhouettes(std::vector<Silhouette>{{camera, random_pixels(random, 24, 20, 0.9)}});
  depth_of(sweep, whole_image(camera), View{camera, 0.5, 2.0}, SweepRange{0.5, 2.0});
  EXPECT_FALSE(glIsEnabled(GL_SCISSOR_TEST));
  EXPECT_FALSE(glIsEnabled(GL_DEPTH_TEST));
  EXPECT_FALSE(glIsEnabled(GL_STENCIL_TEST));
}

TEST(SweepRange, IsTheVolumesDepthWithinTheViews) {
  const View view{
      {geometry::pinhole_from_fov(16, 12, 1.0), geometry::look_at({0, -2, 0}, {0, 0, 0})},
      0.05,
      2.25};
  const SweepRange range = sweep_range(
      view, Eigen::AlignedBox3d(Eigen::Vector3d(-1, -0.5, 0), Eigen::Vector3d(1, 0.5, 1)));
  EXPECT_DOUBLE_EQ(range.near_m, 1.5);
  EXPECT_DOUBLE_EQ(range.far_m, 2.25);
  EXPECT_TRUE(
      sweep_range(view, Eigen::AlignedBox3d(Eigen::Vector3d(-1, -9, 0), Eigen::Vector3d(1, -5, 1)))
          .empty());
}

TEST(SweepRange, HoldsEveryCornerOfTheVolume) {
  Random random(8);
  for (int i = 0; i < 50; ++i) {
    const View view{random_camera(random, 16, 12, 5), 0.05, 100};
    const Eigen::Vector3d a = random_in_ball(random, 1), b = random_in_ball(random, 1);
    const Eigen::AlignedBox3d box(a.cwiseMin(b), a.cwiseMax(b));
    double nearest = 100, farthest = 0;
    for (const double x : {a.x(), b.x()})
      for (const double y : {a.y(), b.y()})
        for (const double z : {a.z(), b.z()}) {
          const double depth = (view.camera.camera_from_world * Eigen::Vector3d(x, y, z)).z();
          nearest = std::min(nearest, depth), farthest = std::max(farthest, depth);
        }
    const SweepRange range = sweep_range(view, box);
    EXPECT_NEAR(range.near_m, nearest, 1e-12);
    EXPECT_NEAR(range.far_m, farthest, 1e-12);
    EXPECT_FALSE(range.empty());
  }
}

TEST(SweepRange, IsEmptyUnlessItsEndIsBeyondItsStart) {
  EXPECT_FALSE((SweepRange{1, 1.5}).empty());
  EXPECT_TRUE((SweepRange{1, 1}).empty());
  EXPECT_TRUE((SweepRange{1.5, 1}).empty());
}

}  // namespace
}  // namespace fivepipe::hull
