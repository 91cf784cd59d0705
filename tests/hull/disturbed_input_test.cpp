// Disturbed input: calibration errors, late frames, shadows and lost cameras change the hull only
// as its definition requires. The result of backend `cpu` does not depend on the machine.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>

#include "common/hull/carving_diagnosis.h"
#include "common/hull/oracle/reference.h"
#include "common/hull/query/hull_query.h"
#include "tests/support/hull/scenes.h"

namespace fivepipe::hull {
namespace {

using namespace test;
using Eigen::Vector3d;

constexpr float kTie_m = 1e-6f;  // tolerance for borders that coincide [m]

// Four cameras about an upright figure; a view from between two of them.
struct DisturbedInput : ::testing::Test {
  std::vector<geometry::Camera> cameras;
  View view{
      {geometry::pinhole_from_fov(96, 72, 0.5), geometry::look_at({1.3, 0.9, 0.5}, {0, 0, 0.1})},
      0.1,
      4};
  base::WorkerPool pool{2};
  DisturbedInput() {
    for (int i = 0; i < 4; ++i)
      cameras.push_back(
          {geometry::pinhole_from_fov(180, 140, 0.7),
           geometry::look_at({1.5 * std::cos(1.6 * i), 1.5 * std::sin(1.6 * i), 0.6 + 0.1 * i},
                             {0, 0, 0.1})});
  }
  static std::vector<Capsule> figure(const Vector3d& at = Vector3d::Zero()) {
    return {{at, at + Vector3d(0, 0, 0.2), 0.05},
            {at + Vector3d(0, 0, 0.12), at + Vector3d(0.1, 0.05, 0.18), 0.02}};
  }
  std::vector<Silhouette> seen(const std::vector<Capsule>& object) const {
    return test::silhouettes_of(object, cameras);
  }
  std::vector<float> depth(std::span<const Silhouette> silhouettes) {
    return CpuHull(pool, silhouettes).depth(view, test::whole_image(view.camera)).depth_m;
  }
};

int hits(const std::vector<float>& depth) {
  return int(std::count_if(depth.begin(), depth.end(), [](float d) { return d != kNoHull; }));
}

// Expects that each ray that meets the inner hull meets the outer hull no later.
void expect_within(const std::vector<float>& inner, const std::vector<float>& outer) {
  for (std::size_t i = 0; i < inner.size(); ++i)
    EXPECT_TRUE(inner[i] == kNoHull || (outer[i] != kNoHull && outer[i] <= inner[i] + kTie_m))
        << "ray " << i;
}

// Grows the object by one pixel, or shrinks it.
ObjectPixels grown(const ObjectPixels& pixels, bool shrink) {
  ObjectPixels out(pixels.width_px(), pixels.height_px());
  for (int v = 0; v < pixels.height_px(); ++v)
    for (int u = 0; u < pixels.width_px(); ++u) {
      int near = 0;
      for (int dv = -1; dv <= 1; ++dv)
        for (int du = -1; du <= 1; ++du) near += pixels.contains(u + du, v + dv);
      if (shrink ? near == 9 : near > 0) out.set(u, v);
    }
  return out;
}

// The hull lies between those of the maps shrunk and grown by one pixel.
TEST_F(DisturbedInput, CalibrationErrorOfOnePixelChangesTheHullByAtMostOnePixel) {
  auto right = seen(figure()), wrong = right, wide = right, narrow = right;
  wrong[0].camera.pinhole.cx_px += 1;
  wrong[2].camera.pinhole.cy_px -= 1;
  for (const int i : {0, 2})
    wide[i].pixels = grown(right[i].pixels, false), narrow[i].pixels = grown(right[i].pixels, true);
  const auto off = depth(wrong);
  EXPECT_NE(off, depth(right));
  EXPECT_GT(hits(off), 200);
  expect_within(off, depth(wide));
  expect_within(depth(narrow), off);
}

// The hull is the part of the other cameras' hull that the late map keeps.
TEST_F(DisturbedInput, LateFrameStaysInTheHullOfTheOtherCameras) {
  auto set = seen(figure({0.03, 0, 0}));
  const auto others = depth(std::span(set).subspan(1)), now = depth(set);
  set[0] = seen(figure())[0];
  const auto late = depth(set);
  EXPECT_GT(hits(late), 100);
  EXPECT_NE(late, now);
  expect_within(late, others);
}

// The hull is empty while the figure is elsewhere, the diagnosis names the camera, and the hull is
// complete when the figure is back.
TEST_F(DisturbedInput, FrozenCameraIsNamedByTheDiagnosis) {
  const auto frozen = seen(figure())[0];
  const auto at_start = depth(seen(figure()));
  auto away = seen(figure({0.25, -0.2, 0}));
  EXPECT_GT(hits(depth(away)), 100);
  away[0] = frozen;
  EXPECT_EQ(hits(depth(away)), 0);
  const auto diagnosis = diagnose_volume(
      away, {Vector3d(-0.1, -0.4, -0.1), Vector3d(0.5, 0.2, 0.4)}, pool, {}, {20000, 1});
  EXPECT_EQ(diagnosis.hull.volume_m3, 0);
  EXPECT_GT(diagnosis.cameras[0].removed_alone.volume_m3, 1e-3);
  for (int i = 1; i < 4; ++i)
    EXPECT_LT(2 * diagnosis.cameras[std::size_t(i)].removed_alone.volume_m3,
              diagnosis.cameras[0].removed_alone.volume_m3);
  auto back = seen(figure());
  back[0] = frozen;
  EXPECT_EQ(depth(back), at_start);
}

// The shadow adds at most what the other cameras keep, and removes nothing.
TEST_F(DisturbedInput, ShadowSegmentedAsObjectOnlyAddsVolume) {
  const auto clean = seen(figure());
  auto shadowed = clean;
  const auto shadow = test::silhouettes_of({{{0, 0, -0.05}, {-0.2, 0.15, -0.05}, 0.04}}, cameras);
  for (int v = 0; v < 140; ++v)
    for (int u = 0; u < 180; ++u)
      if (shadow[1].pixels.contains(u, v)) shadowed[1].pixels.set(u, v);
  const auto with = depth(shadowed);
  expect_within(depth(clean), with);
  const std::vector<Silhouette> others{clean[0], clean[2], clean[3]};
  expect_within(with, depth(others));
}

TEST_F(DisturbedInput, RestoredCameraRestoresTheHull) {
  const auto all = seen(figure());
  CpuHull hull(pool);
  const auto depth_now = [&](std::span<const Silhouette> silhouettes) {
    hull.assign(silhouettes);
    return hull.depth(view, test::whole_image(view.camera)).depth_m;
  };
  const auto before = depth_now(all), without = depth_now(std::span(all).first(3)),
             after = depth_now(all);
  EXPECT_EQ(before, after);
  EXPECT_GT(hits(without), hits(before));
  expect_within(before, without);
}

void expect_reference(const std::vector<Silhouette>& silhouettes, const View& view, int step,
                      int min_hits) {
  const auto depth = test::cpu_depth(silhouettes, view, test::whole_image(view.camera)).depth_m;
  int hit = 0;
  for (int i = 0; i < int(depth.size()); i += step) {
    const auto pieces = reference_intervals(
        silhouettes,
        geometry::ray_through(view.camera, Eigen::Vector2d(i % view.camera.pinhole.width_px,
                                                           i / view.camera.pinhole.width_px)),
        view.near_m, view.far_m);
    const float d = depth[std::size_t(i)];
    bool agrees = pieces.empty() && d == kNoHull;
    for (const Interval& piece : pieces) {
      if (d != kNoHull && std::abs(d - piece.enter) <= std::max(kTie_m, 2e-6f * d)) agrees = true;
      if (piece.leave - piece.enter > 1e-9) break;  // the backend may miss a piece this short
    }
    EXPECT_TRUE(agrees) << "ray " << i << ": " << d << ", reference "
                        << (pieces.empty() ? 0 : pieces.front().enter);
    hit += d != kNoHull;
  }
  EXPECT_GE(hit, min_hits);
}

// The images of such rays do not move, or move little in any direction.
TEST(SimdPrecisionLimits, EyeAtOrNextToACameraCentreEqualsTheReference) {
  for (int seed = 1; seed <= 6; ++seed)
    for (const double off_m : {0.0, 1e-12, 1e-9, 1e-6, 1e-4, 1e-2}) {
      SCOPED_TRACE(seed);
      SCOPED_TRACE(off_m);
      test::Random random(seed);
      const auto silhouettes =
          test::silhouettes_of({test::random_cameras(random, 3), test::random_object(random, 3)});
      View view{{geometry::pinhole_from_fov(48, 36, 0.6), silhouettes[0].camera.camera_from_world},
                0.05,
                5};
      view.camera.camera_from_world.translation() += off_m * test::random_direction(random);
      expect_reference(silhouettes, view, 3, 10);
      for (const int axis :
           {0, 1}) {  // along one axis: its direction is certain, that of the other axis is not
        view.camera.camera_from_world = silhouettes[0].camera.camera_from_world;
        view.camera.camera_from_world.translation()[axis] += off_m;
        expect_reference(silhouettes, view, 3, 10);
      }
    }
}

// Compares every ray of many views of noise, in which every border is near another. Without its
// error bounds the float code would decide some of these rays wrongly.
TEST(SimdPrecisionLimits, AgreeWithDoubleOnNoise) {
  base::WorkerPool pool(2);
  int rays = 0, hit = 0;
  for (int seed = 1; seed <= 24; ++seed) {
    SCOPED_TRACE(seed);
    test::Random random(seed);
    std::vector<Silhouette> silhouettes;
    for (const geometry::Camera& camera : test::random_cameras(random, 2 + seed % 3, 700, 500))
      silhouettes.push_back({camera, test::random_pixels(random, 700, 500, seed % 2 ? 0.3 : 0.02)});
    const View view{test::random_camera(random, 160, 120, 0.9), 0.05, 4};
    CpuHull hull(pool, silhouettes);
    const auto depth = hull.depth(view, test::whole_image(view.camera)).depth_m;
    const HullQuery query(hull);
    for (int i = 0; i < int(depth.size()); ++i) {
      const auto entry =
          query.first_entry(geometry::ray_through(view.camera, Eigen::Vector2d(i % 160, i / 160)),
                            view.near_m, view.far_m);
      const double d = depth[std::size_t(i)];
      ++rays;
      hit += entry.has_value();
      ASSERT_EQ(entry.has_value(), d != kNoHull) << "ray " << i;
      if (entry) {
        ASSERT_NEAR(d, *entry, 1e-6 * d) << "ray " << i;
      }
    }
  }
  EXPECT_GT(hit, rays / 4);
}

TEST(SimdPrecisionLimits, CameraNearTheEyeHasALargeDepthRatio) {
  for (int seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    test::Random random(seed);
    const Eigen::Isometry3d eye = geometry::look_at({0, -1.2, 0.1}, {0, 0, 0});
    std::vector<geometry::Camera> cameras = test::random_cameras(random, 2);
    cameras.push_back(
        {geometry::pinhole_from_fov(120, 90, 1.2),
         geometry::look_at({0.03 * test::uniform(random, -1, 1), -1.1, 0.1},
                           {0, 0, 0})});  // a coarse camera, 10 cm in front of the eye
    expect_reference(test::silhouettes_of(test::random_object(random, 3), cameras),
                     {{geometry::pinhole_from_fov(160, 120, 0.4), eye}, 0.12, 6}, 7, 20);
  }
}

TEST(SimdPrecisionLimits, MoreCamerasThanTheKernelsHoldEqualTheReference) {
  for (const int cameras : {64, 65, 130}) {
    SCOPED_TRACE(cameras);
    test::Random random(cameras);
    expect_reference(
        test::silhouettes_of(
            {test::random_cameras(random, cameras, 80, 60), test::random_object(random, 3, 0.1)}),
        {{geometry::pinhole_from_fov(48, 36, 0.3), geometry::look_at({0.4, -0.5, 0.2}, {0, 0, 0})},
         0.05,
         4},
        5, 3);
  }
}

// A map of 25 million pixels with objects in opposite corners, so that all of it is stored.
TEST(SimdPrecisionLimits, MapLargerThanFloatCanIndexEqualsTheReference) {
  const int size = 5000;
  std::vector<Silhouette> silhouettes;
  for (const Vector3d& at : {Vector3d(2, 0, 0), Vector3d(0, 2, 0)}) {
    silhouettes.push_back(
        {{geometry::pinhole_from_fov(size, size, 0.5), geometry::look_at(at, {0, 0, 0})},
         ObjectPixels(size, size)});
    for (int v = 0; v < size; ++v)
      for (int u = 0; u < size; u += 1 + (v % 3 != 0))
        if ((u + v) % 1400 < 200 || (u < 9 && v < 9) || (u > size - 9 && v > size - 9))
          silhouettes.back().pixels.set(u, v);
  }
  expect_reference(
      silhouettes,
      {{geometry::pinhole_from_fov(40, 30, 0.3), geometry::look_at({1.2, 1.5, 0.3}, {0, 0, 0})},
       0.05,
       5},
      23, 5);
}

TEST_F(DisturbedInput, IsBitIdenticalForAnyThreadCount) {
  const auto set = seen(figure());
  for (const HullRule& rule : {HullRule{}, HullRule{Limits::seen, 2}}) {
    std::vector<float> first;
    for (const int threads : {1, 2, 3, 8}) {
      base::WorkerPool some(threads);
      const auto depth_m =
          CpuHull(some, set, rule).depth(view, test::whole_image(view.camera)).depth_m;
      if (first.empty()) first = depth_m;
      EXPECT_EQ(depth_m, first);
    }
  }
}

TEST(SimdTargets, EveryInstructionSetGivesTheSameBits) {
  struct Restore {
    ~Restore() {
      hwy::SetSupportedTargetsForTest(0);
      hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    }
  } restore;
  const auto supported = hwy::SupportedTargets();
  int tried = 0;
  std::vector<std::vector<float>> first;
  for (auto left = supported; left; left &= left - 1) {
    hwy::SetSupportedTargetsForTest(left & -left);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    std::vector<std::vector<float>> depths;
    for (int seed = 1; seed <= 12; ++seed) {
      test::Random random(seed);
      const auto cameras = test::random_cameras(random, 1 + seed % 5, 200, 150);
      const auto silhouettes = test::silhouettes_of(test::random_object(random, 3), cameras);
      const View view{test::random_camera(random, 101, 77, 0.8), 0.05, 5.0};
      depths.push_back(test::cpu_depth(silhouettes, view, test::whole_image(view.camera)).depth_m);
    }
    if (first.empty()) first = depths;
    EXPECT_EQ(depths, first) << hwy::TargetName(left & -left);
    ++tried;
  }
  RecordProperty("instruction_sets", tried);
}

TEST(LimitsSeen, DepthEqualsTheReference) {
  int hit = 0;
  for (int seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(seed);
    test::Random random(seed);
    const auto silhouettes = test::silhouettes_of(
        {test::random_cameras(random, 2 + seed % 4, 60, 45), test::random_object(random, 3, 0.35)});
    const HullRule rule{Limits::seen, 1 + seed % 3};
    const View view{test::random_camera(random, 32, 24, 1.0), 0.05, 4.0};
    base::WorkerPool pool(2);
    const auto depth =
        CpuHull(pool, silhouettes, rule).depth(view, test::whole_image(view.camera)).depth_m;
    for (int i = 0; i < 32 * 24; i += 3) {
      const auto pieces = reference_intervals(
          silhouettes, geometry::ray_through(view.camera, Eigen::Vector2d(i % 32, i / 32)),
          view.near_m, view.far_m, rule);
      ASSERT_EQ(depth[std::size_t(i)] == kNoHull, pieces.empty()) << "ray " << i;
      if (pieces.empty()) continue;
      EXPECT_NEAR(depth[std::size_t(i)], pieces.front().enter, 2e-6 * pieces.front().enter);
      ++hit;
    }
  }
  EXPECT_GT(hit, 300);
}

}  // namespace
}  // namespace fivepipe::hull
