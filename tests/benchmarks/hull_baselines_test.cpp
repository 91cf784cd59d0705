// The baselines of the hull benchmark compute what they claim. Otherwise the benchmark would
// compare with wrong results.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <optional>

#include "benchmarks/hull/baselines/cpu_plane_sweep.h"
#include "benchmarks/hull/baselines/image_based_hull.h"
#include "benchmarks/hull/baselines/voxel_carving.h"
#include "common/hull/oracle/reference.h"
#include "tests/support/hull/scenes.h"

namespace fivepipe::baselines {
namespace {

using test::Random;
using test::uniform;
using Depths = std::vector<float>;

constexpr double kNear_m = 0.3, kFar_m = 3;

struct Case {
  std::vector<hull::Silhouette> silhouettes;
  hull::View view;
  geometry::Ray ray(std::size_t i) const {
    const int width = view.camera.pinhole.width_px;
    return geometry::ray_through(view.camera,
                                 Eigen::Vector2d(double(int(i) % width), double(int(i) / width)));
  }
};

// The sizes are no multiple of a tile or of a SIMD width.
Case random_case(std::uint64_t seed, int cameras) {
  test::Random random(seed);
  Case c{
      test::silhouettes_of({test::random_cameras(random, cameras), test::random_object(random, 5)}),
      {}};
  c.view = {test::random_camera(random, 83, 67), kNear_m, kFar_m};
  return c;
}

Depths depths_of(const Case& c, int threads,
                 const std::function<void(base::WorkerPool&, std::span<float>)>& method) {
  base::WorkerPool pool(threads);
  Depths depths(std::size_t(c.view.camera.pinhole.width_px) * c.view.camera.pinhole.height_px,
                -1.0f);
  method(pool, depths);
  return depths;
}

Depths image_based(const Case& c, int threads = 1) {
  return depths_of(c, threads, [&](base::WorkerPool& pool, std::span<float> depths) {
    ImageBasedHull().depth(c.silhouettes, c.view, pool, depths);
  });
}

bool same_bits(const Depths& a, const Depths& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

// The rounding of float in map coordinates is 1e-4 px: eight roundings of positions up to a few
// hundred pixels. At less than 20 mm per pixel, and at angles that lengthen it up to twenty times
// in depth, this is the resulting error in depth.
constexpr double kRounding_m = 4e-5;
// The fraction of rays that touch a corner or a thin end of the hull within that rounding, so that
// they hit a piece that the reference misses, or the reverse.
constexpr double kTies = 1e-4;

struct Agreement {
  std::size_t rays = 0, hits = 0, mismatches = 0;
};
void compare(const Case& c, const Depths& depths, Agreement& agreement) {
  for (std::size_t i = 0; i < depths.size(); ++i) {
    const auto pieces =
        hull::reference_intervals(c.silhouettes, c.ray(i), c.view.near_m, c.view.far_m);
    const bool hit = depths[i] != hull::kNoHull;
    ++agreement.rays;
    agreement.hits += hit;
    if (hit != !pieces.empty() ||
        (hit && !(std::abs(depths[i] - pieces.front().enter) <= kRounding_m)))
      ++agreement.mismatches;
  }
}
void expect_agreement(const Agreement& agreement) {
  EXPECT_GT(agreement.hits, agreement.rays / 100);
  EXPECT_LE(double(agreement.mismatches), kTies * double(agreement.rays));
}

TEST(ImageBasedHull, AgreesWithTheReferenceOnRandomRigs) {
  Agreement agreement;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const Case c = random_case(seed, 1 + int(seed % 6));
    compare(c, image_based(c), agreement);
  }
  expect_agreement(agreement);
}

TEST(ImageBasedHull, AgreesWithTheReferenceOnNoise) {
  Agreement agreement;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    test::Random random(seed);
    Case c = random_case(seed, 3);
    for (hull::Silhouette& s : c.silhouettes)
      s.pixels = test::random_pixels(random, s.pixels.width_px(), s.pixels.height_px(), 0.7);
    compare(c, image_based(c), agreement);
  }
  expect_agreement(agreement);
}

// The eye is at the center of each map in turn, in front of and behind its camera, and beside the
// camera, so that epipoles are at infinity.
TEST(ImageBasedHull, AgreesWithTheReferenceForAllEpipoles) {
  Agreement agreement;
  for (std::uint64_t seed = 0; seed < 24; ++seed) {
    test::Random random(seed);
    Case c = random_case(seed, 3);
    const Eigen::Isometry3d world_from_camera =
        c.silhouettes[seed % 3].camera.camera_from_world.inverse();
    const double sideways = seed % 4 == 3 ? 1 : 0;
    const Eigen::Vector3d in_camera{0.1 * sideways + test::uniform(random, -0.02, 0.02),
                                    test::uniform(random, -0.02, 0.02),
                                    sideways   ? 0
                                    : seed % 2 ? 0.4
                                               : -0.4};
    c.view.camera.camera_from_world = geometry::look_at(
        world_from_camera * in_camera, Eigen::Vector3d::Zero(), test::random_direction(random));
    compare(c, image_based(c), agreement);
  }
  expect_agreement(agreement);
}

TEST(ImageBasedHull, AgreesWithTheReferenceAtACameraCenter) {
  Agreement agreement;
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    Case c = random_case(seed, 3);
    c.view.camera.camera_from_world = c.silhouettes[1].camera.camera_from_world;
    compare(c, image_based(c), agreement);
  }
  expect_agreement(agreement);
}

TEST(ImageBasedHull, ReturnsNearForAnEyeInsideTheHull) {
  Case c = random_case(1, 3);
  for (hull::Silhouette& s : c.silhouettes)
    for (int v = 0; v < s.pixels.height_px(); ++v)
      for (int u = 0; u < s.pixels.width_px(); ++u) s.pixels.set(u, v);
  c.view.camera.camera_from_world = geometry::look_at({0.05, 0.02, 0.01}, {0, 0, 0});
  c.view.near_m = 0.01;
  const Depths depths = image_based(c);
  EXPECT_EQ(depths[40 + 33 * 83], 0.01f);
}

TEST(ImageBasedHull, IsIndependentOfThreads) {
  const Case c = random_case(3, 4);
  const Depths one = image_based(c, 1);
  for (const int threads : {2, 5}) EXPECT_TRUE(same_bits(one, image_based(c, threads)));
}

Depths plane_sweep(const Case& c, int planes, int threads = 1) {
  return depths_of(c, threads, [&](base::WorkerPool& pool, std::span<float> depths) {
    CpuPlaneSweep(planes).depth(c.silhouettes, c.view, pool, depths);
  });
}

// A plane within this distance of the point where a ray enters or leaves a piece may be on either
// side of it by rounding. Float resolves depths of 3 m to 2e-7 m, and map positions to 1e-4 px,
// which is 1e-6 m, and twenty times as much at grazing angles.
constexpr double kPlaneRounding_m = 2e-5;

std::optional<double> first_plane_in(const std::vector<hull::Interval>& pieces, double near_m,
                                     double spacing_m) {
  for (const hull::Interval& piece : pieces) {
    const double plane = near_m + std::ceil((piece.enter - near_m) / spacing_m) * spacing_m;
    if (plane < piece.leave) return plane;
  }
  return std::nullopt;
}

TEST(CpuPlaneSweep, FindsTheFirstPlaneInTheHull) {
  std::size_t hits = 0, mismatches = 0, rays = 0;
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    const Case c = random_case(seed, 1 + int(seed % 5));
    const int planes = 40 + int(seed) * 7;
    const double spacing_m = (kFar_m - kNear_m) / planes;
    const Depths depths = plane_sweep(c, planes);
    for (std::size_t i = 0; i < depths.size(); ++i) {
      const auto expected = first_plane_in(
          hull::reference_intervals(c.silhouettes, c.ray(i), kNear_m, kFar_m), kNear_m, spacing_m);
      ++rays;
      hits += depths[i] != hull::kNoHull;
      mismatches += expected ? !(std::abs(depths[i] - *expected) <= kPlaneRounding_m)
                             : depths[i] != hull::kNoHull;
    }
  }
  EXPECT_GT(hits, rays / 100);
  // Planes within kPlaneRounding_m of a piece's end: less than 1 in 500 for spacings of 10 to 70
  // mm, and two ends per piece.
  EXPECT_LE(double(mismatches), 4e-3 * double(hits));
}

TEST(CpuPlaneSweep, ErrorIsBelowTheSpacingOnThickPieces) {
  const Case c = random_case(7, 4);
  const int planes = 256;
  const double spacing_m = (kFar_m - kNear_m) / planes;
  const Depths depths = plane_sweep(c, planes);
  std::size_t met = 0;
  for (std::size_t i = 0; i < depths.size(); ++i) {
    const auto pieces = hull::reference_intervals(c.silhouettes, c.ray(i), kNear_m, kFar_m);
    if (pieces.empty() ||
        pieces.front().leave - pieces.front().enter < spacing_m + kPlaneRounding_m)
      continue;
    ++met;
    EXPECT_GE(depths[i], pieces.front().enter - kPlaneRounding_m);
    EXPECT_LE(depths[i], pieces.front().enter + spacing_m + kPlaneRounding_m);
  }
  EXPECT_GT(met, 100u);
}

TEST(CpuPlaneSweep, CenteredDepthsAreHalfASpacingBeforeThePlanes) {
  const Case c = random_case(9, 3);
  const double spacing_m = (kFar_m - kNear_m) / 100;
  const Depths planes = plane_sweep(c, 100);
  const Depths centered = depths_of(c, 1, [&](base::WorkerPool& pool, std::span<float> depths) {
    CpuPlaneSweep(100, SweptDepth::centered).depth(c.silhouettes, c.view, pool, depths);
  });
  for (std::size_t i = 0; i < planes.size(); ++i)
    EXPECT_NEAR(centered[i],
                planes[i] == hull::kNoHull ? hull::kNoHull : planes[i] - 0.5 * spacing_m,
                kPlaneRounding_m);
}

TEST(CpuPlaneSweep, IsIndependentOfThreads) {
  const Case c = random_case(3, 4);
  const Depths one = plane_sweep(c, 100, 1);
  for (const int threads : {2, 5}) EXPECT_TRUE(same_bits(one, plane_sweep(c, 100, threads)));
}

const Eigen::AlignedBox3d kVolume_world_m(Eigen::Vector3d(-0.3, -0.25, -0.2),
                                          Eigen::Vector3d(0.25, 0.3, 0.3));

Depths carving(VoxelCarving& voxels, const Case& c, int threads = 1) {
  return depths_of(c, threads, [&](base::WorkerPool& pool, std::span<float> depths) {
    voxels.depth(c.silhouettes, c.view, pool, depths);
  });
}

// The fraction of voxel centers that are within the rounding of float of a pixel's border and may
// be classified either way: 1e-4 px on two axes, for some cameras.
constexpr double kVoxelTies = 2e-3;

TEST(VoxelCarving, KeepsVoxelsWhoseCentersAreInTheHull) {
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    Case c = random_case(seed, 1 + int(seed % 5));
    test::Random random(seed);
    if (seed % 4 == 3)
      for (hull::Silhouette& s : c.silhouettes)
        s.pixels = test::random_pixels(random, 160, 121, 0.6);
    VoxelCarving voxels(kVolume_world_m, 0.006);
    carving(voxels, c);
    const VoxelGrid& grid = voxels.grid();
    std::size_t occupied = 0, mismatches = 0;
    for (int z = 0; z < grid.bricks[2] * kBrick_voxels; ++z)
      for (int y = 0; y < grid.bricks[1] * kBrick_voxels; ++y)
        for (int x = 0; x < grid.bricks[0] * kBrick_voxels; ++x) {
          const bool in = hull::in_hull(
              c.silhouettes,
              grid.corner_world_m + grid.voxel_m * Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5));
          occupied += in;
          mismatches += in != grid.occupied(x, y, z);
        }
    EXPECT_GT(occupied, 50u);
    EXPECT_LE(double(mismatches), kVoxelTies * double(occupied)) << seed;
  }
}

// Returns the entry into the first occupied voxel, from all crossings of the ray with voxel
// borders.
std::optional<double> first_voxel_m(const VoxelGrid& grid, const geometry::Ray& ray, double near_m,
                                    double far_m) {
  const Eigen::Vector3d eye = (ray.origin_world_m - grid.corner_world_m) / grid.voxel_m,
                        slope = ray.direction_world / grid.voxel_m;
  std::vector<double> crossings{near_m, far_m};
  for (int axis = 0; axis < 3; ++axis)
    for (int border = 0; border <= grid.bricks[std::size_t(axis)] * kBrick_voxels; ++border)
      if (const double t = (border - eye[axis]) / slope[axis]; t > near_m && t < far_m)
        crossings.push_back(t);
  std::sort(crossings.begin(), crossings.end());
  for (std::size_t i = 1; i < crossings.size(); ++i) {
    const Eigen::Vector3d center = eye + 0.5 * (crossings[i - 1] + crossings[i]) * slope;
    if (grid.occupied(int(std::floor(center.x())), int(std::floor(center.y())),
                      int(std::floor(center.z()))))
      return crossings[i - 1];
  }
  return std::nullopt;
}

TEST(VoxelCarving, ReturnsTheFirstOccupiedVoxelOfEveryRay) {
  // The rounding of float is 1e-5 voxels of some 6 mm, and a hundred times as much in depth at
  // grazing angles. Rays that touch an edge of a voxel within it may hit or miss the voxel.
  constexpr double kDepthRounding_m = 1e-5, kTouching = 2e-3;
  std::size_t hits = 0, mismatches = 0;
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    Case c = random_case(seed, 3);
    if (seed % 3 == 2)
      c.view.camera.camera_from_world =
          geometry::look_at({0.05, 0.02, 0.01}, {0.2, 0.1, 0.02});  // an eye inside the volume
    if (seed % 3 == 2) c.view.near_m = 0.01;
    VoxelCarving voxels(kVolume_world_m, seed % 2 ? 0.004 : 0.011);
    const Depths depths = carving(voxels, c);
    for (std::size_t i = 0; i < depths.size(); ++i) {
      const auto expected = first_voxel_m(voxels.grid(), c.ray(i), c.view.near_m, c.view.far_m);
      hits += depths[i] != hull::kNoHull;
      mismatches += expected ? !(std::abs(depths[i] - *expected) <= kDepthRounding_m)
                             : depths[i] != hull::kNoHull;
    }
  }
  EXPECT_GT(hits, 5000u);
  EXPECT_LE(double(mismatches), kTouching * double(hits));
}

TEST(VoxelCarving, IsIndependentOfThreads) {
  const Case c = random_case(3, 4);
  VoxelCarving voxels(kVolume_world_m, 0.004);
  const Depths one = carving(voxels, c, 1);
  for (const int threads : {2, 5}) EXPECT_TRUE(same_bits(one, carving(voxels, c, threads)));
}

TEST(VoxelCarving, AcceptsTheDocumentedCameraCount) {
  Case c = random_case(3, 2);
  VoxelCarving voxels(kVolume_world_m, 0.01);
  const Depths two = carving(voxels, c);
  while (c.silhouettes.size() < kMaxCarvingCameras)
    c.silhouettes.push_back(c.silhouettes[c.silhouettes.size() % 2]);
  EXPECT_TRUE(same_bits(two, carving(voxels, c)));
  c.silhouettes.push_back(c.silhouettes.front());
  EXPECT_THROW(carving(voxels, c), std::invalid_argument);
}

TEST(VoxelCarving, RejectsInvalidVolumes) {
  EXPECT_THROW(VoxelCarving({}, 0.01), std::invalid_argument);
  for (const double voxel_m : {0.0, -1.0, std::nan(""), 1e-9})
    EXPECT_THROW(VoxelCarving(kVolume_world_m, voxel_m), std::invalid_argument);
}

TEST(Baselines, AreEmptyWithoutCamerasOrObjectPixels) {
  Case c = random_case(4, 3);
  const Depths none(83 * 67, hull::kNoHull);
  VoxelCarving voxels(kVolume_world_m, 0.01);
  c.silhouettes[1].pixels = hull::ObjectPixels(160, 121);
  for (const Depths& depths : {image_based(c), plane_sweep(c, 64), carving(voxels, c)})
    EXPECT_TRUE(same_bits(depths, none));
  c.silhouettes.clear();
  for (const Depths& depths : {image_based(c), plane_sweep(c, 64), carving(voxels, c)})
    EXPECT_TRUE(same_bits(depths, none));
}

// Vectors of 4, 8 and 16 lanes give the same results up to rounding, which differs with fused
// multiply-adds and approximate reciprocals.
TEST(Baselines, AgreeForEverySimdWidth) {
  const Case c = random_case(5, 4);
  VoxelCarving voxels(kVolume_world_m, 0.005);
  const auto all = [&] {
    return std::array{image_based(c), plane_sweep(c, 200), carving(voxels, c)};
  };
  const auto widest = all();
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    const auto here = all();
    for (std::size_t method = 0; method < here.size(); ++method) {
      std::size_t mismatches = 0;
      for (std::size_t i = 0; i < here[method].size(); ++i)
        mismatches += !(std::abs(here[method][i] - widest[method][i]) <= kRounding_m);
      EXPECT_LE(double(mismatches), kVoxelTies * double(here[method].size()))
          << hwy::TargetName(target) << ", method " << method;
    }
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

}  // namespace
}  // namespace fivepipe::baselines
