// The benchmark's rivals give what they claim: a comparison with something wrong is worth nothing.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>

#include "common/hull/reference.h"
#include "common/hull/rivals/image_based_hull.h"
#include "tests/hull_scenes.h"

namespace fivepipe::rivals {
namespace {

using test::Random;
using test::uniform;
using Depths = std::vector<float>;

constexpr double kNear_m = 0.3, kFar_m = 3;

struct Case {
  std::vector<Silhouette> silhouettes;
  View view;
  Ray ray(std::size_t i) const {
    const int width = view.camera.pinhole.width_px;
    return ray_through(view.camera, Eigen::Vector2d(double(int(i) % width), double(int(i) / width)));
  }
};

// Sizes that are no multiple of any tile or of the lanes.
Case random_case(std::uint64_t seed, int cameras) {
  Random random(seed);
  Case c{test::silhouettes_of(test::random_object(random, 5), test::random_cameras(random, cameras)), {}};
  c.view = {test::random_camera(random, 83, 67), kNear_m, kFar_m};
  return c;
}

Depths depths_of(const Case& c, int threads, const std::function<void(WorkerPool&, std::span<float>)>& method) {
  WorkerPool pool(threads);
  Depths depths(std::size_t(c.view.camera.pinhole.width_px) * c.view.camera.pinhole.height_px, -1.0f);
  method(pool, depths);
  return depths;
}

Depths image_based(const Case& c, int threads = 1) {
  return depths_of(c, threads, [&](WorkerPool& pool, std::span<float> depths) { ImageBasedHull().depth(c.silhouettes, c.view, pool, depths); });
}

bool same_bits(const Depths& a, const Depths& b) { return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0; }

// --- image-based visual hulls ----------------------------------------------------------------------------------------

// Rounding of float in map coordinates: positions of up to a few hundred pixels, eight roundings, hence 1e-4 px, seen at angles
// that make it up to twenty times as long in depth, at less than 20 mm a pixel.
constexpr double kRounding_m = 4e-5;
// Rays that touch a corner or a thin end of the hull within that rounding, and so have or miss a piece that the reference
// misses or has.
constexpr double kTies = 1e-4;

struct Agreement {
  std::size_t rays = 0, hits = 0, others = 0;
};
void compare(const Case& c, const Depths& depths, Agreement& agreement) {
  for (std::size_t i = 0; i < depths.size(); ++i) {
    const auto pieces = reference_intervals(c.silhouettes, c.ray(i), c.view.near_m, c.view.far_m);
    const bool hit = depths[i] != kNoHull;
    ++agreement.rays;
    agreement.hits += hit;
    if (hit != !pieces.empty() || (hit && !(std::abs(depths[i] - pieces.front().enter) <= kRounding_m))) ++agreement.others;
  }
}
void expect_agreement(const Agreement& agreement) {
  EXPECT_GT(agreement.hits, agreement.rays / 100);
  EXPECT_LE(double(agreement.others), kTies * double(agreement.rays));
}

TEST(ImageBasedHull, AgreesWithTheReferenceOnRandomRigs) {
  Agreement agreement;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const Case c = random_case(seed, 1 + int(seed % 6));
    compare(c, image_based(c), agreement);
  }
  expect_agreement(agreement);
}

TEST(ImageBasedHull, AgreesWhereMapsAreNoise) {
  Agreement agreement;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    Random random(seed);
    Case c = random_case(seed, 3);
    for (Silhouette& s : c.silhouettes) s.pixels = test::random_pixels(random, s.pixels.width_px(), s.pixels.height_px(), 0.7);
    compare(c, image_based(c), agreement);
  }
  expect_agreement(agreement);
}

// The eye in the middle of each map in turn, before and behind its camera, and beside it, where epipoles are at infinity.
TEST(ImageBasedHull, AgreesWhereverTheEpipolesLie) {
  Agreement agreement;
  for (std::uint64_t seed = 0; seed < 24; ++seed) {
    Random random(seed);
    Case c = random_case(seed, 3);
    const Eigen::Isometry3d world_from_camera = c.silhouettes[seed % 3].camera.camera_from_world.inverse();
    const double sideways = seed % 4 == 3 ? 1 : 0;
    const Eigen::Vector3d in_camera(0.1 * sideways + uniform(random, -0.02, 0.02), uniform(random, -0.02, 0.02), sideways ? 0 : seed % 2 ? 0.4 : -0.4);
    c.view.camera.camera_from_world = look_at(world_from_camera * in_camera, Eigen::Vector3d::Zero(), test::random_direction(random));
    compare(c, image_based(c), agreement);
  }
  expect_agreement(agreement);
}

TEST(ImageBasedHull, SeesFromOneOfItsCameras) {
  Agreement agreement;
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    Case c = random_case(seed, 3);
    c.view.camera.camera_from_world = c.silhouettes[1].camera.camera_from_world;
    compare(c, image_based(c), agreement);
  }
  expect_agreement(agreement);
}

TEST(ImageBasedHull, StartsAtNearInsideTheHull) {
  Case c = random_case(1, 3);
  for (Silhouette& s : c.silhouettes)
    for (int v = 0; v < s.pixels.height_px(); ++v)
      for (int u = 0; u < s.pixels.width_px(); ++u) s.pixels.set(u, v);
  c.view.camera.camera_from_world = look_at({0.05, 0.02, 0.01}, {0, 0, 0});
  c.view.near_m = 0.01;
  const Depths depths = image_based(c);
  EXPECT_EQ(depths[40 + 33 * 83], 0.01f);
}

TEST(ImageBasedHull, DoesNotDependOnThreads) {
  const Case c = random_case(3, 4);
  const Depths one = image_based(c, 1);
  for (const int threads : {2, 5}) EXPECT_TRUE(same_bits(one, image_based(c, threads)));
}

TEST(ImageBasedHull, IsEmptyWithoutCamerasOrObjectPixels) {
  Case c = random_case(4, 3);
  const Depths none(83 * 67, kNoHull);
  c.silhouettes[1].pixels = ObjectPixels(160, 121);
  EXPECT_TRUE(same_bits(image_based(c), none));
  c.silhouettes.clear();
  EXPECT_TRUE(same_bits(image_based(c), none));
}

}  // namespace
}  // namespace fivepipe::rivals
