#include "common/hull/bench_scene.h"

#include <cmath>
#include <numbers>

namespace fivepipe::bench {
namespace {

using Eigen::Vector3d;

constexpr double kRadians = std::numbers::pi / 180;
constexpr double kCameraDistance_m = 1.4, kCameraElevation_rad = 40 * kRadians;

// Sizes of an adult's hand and forearm [m], wrist at the origin, fingers along x, 10 cm above the table.
std::vector<Capsule> hand_and_forearm() {
  std::vector<Capsule> object{{{-0.02, 0, 0.1}, {-0.27, 0.02, 0.12}, 0.038}};
  for (const double y : {-0.03, -0.01, 0.01, 0.03}) object.push_back({{0, 0.8 * y, 0.1}, {0.075, y, 0.1}, 0.014});
  const double lengths_m[] = {0.06, 0.075, 0.08, 0.07};
  for (int i = 0; i < 4; ++i) {
    const double y = -0.035 + 0.0233 * i;
    object.push_back({{0.08, y, 0.1}, {0.08 + lengths_m[i], 1.5 * y, 0.085 + 0.005 * i}, 0.009});
  }
  object.push_back({{0.02, -0.035, 0.1}, {0.07, -0.085, 0.09}, 0.011});
  return object;
}

}  // namespace

HullScene hand_scene(const std::string& name, double horizontal_fov_rad) {
  HullScene scene{name, hand_and_forearm(), {}, look_at({0.25, -0.45, 0.55}, {0, 0, 0.1})};
  for (const double azimuth_deg : {35.0, 125.0, 215.0, 305.0}) {
    const double a = azimuth_deg * kRadians;
    const Vector3d towards(std::cos(kCameraElevation_rad) * std::cos(a), std::cos(kCameraElevation_rad) * std::sin(a), std::sin(kCameraElevation_rad));
    const Vector3d middle(-0.06, 0, 0.1);
    const Camera camera{pinhole_from_fov(720, 486, horizontal_fov_rad), look_at(middle + kCameraDistance_m * towards, middle)};
    scene.silhouettes.push_back({camera, true_object_pixels(scene.object, camera, PixelRule::touched)});
  }
  return scene;
}

double covered_fraction(const HullScene& scene) {
  double covered = 0, all = 0;
  for (const Silhouette& s : scene.silhouettes) {
    covered += double(s.pixels.count());
    all += double(s.pixels.width_px()) * s.pixels.height_px();
  }
  return covered / all;
}

double pixel_footprint_m(const HullScene& scene) {
  return kCameraDistance_m / scene.silhouettes.front().camera.pinhole.fx_px;
}

}  // namespace fivepipe::bench
