#include "benchmarks/hull/scenes.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>
#include <stdexcept>

#include "common/hull/pbm.h"

namespace fivepipe::hull_bench {
namespace {

using Eigen::Vector3d;

constexpr double kRadians = std::numbers::pi / 180;
constexpr double kCameraDistance_m = 1.4, kCameraElevation_rad = 40 * kRadians;

hull::Silhouette seen(const std::vector<hull::Capsule>& object, const geometry::Camera& camera) {
  return {camera, hull::true_object_pixels(object, camera, hull::PixelRule::touched)};
}

Vector3d direction(double azimuth_rad, double elevation_rad) {
  return {std::cos(elevation_rad) * std::cos(azimuth_rad),
          std::cos(elevation_rad) * std::sin(azimuth_rad), std::sin(elevation_rad)};
}

const Vector3d kCenter(-0.06, 0, 0.1);  // of hand and forearm

HullScene without_cameras(const std::string& name, double view_fov_rad) {
  return {name,         hand_and_forearm(),
          {},           geometry::look_at({0.25, -0.45, 0.55}, {0, 0, 0.1}),
          view_fov_rad, 0.2,
          1.2,          {Vector3d(-0.45, -0.25, -0.05), Vector3d(0.25, 0.25, 0.25)}};
}

// Reads a camera and its map. `fivepipe maps` writes one line per camera: "name width height fx fy
// cx cy" and the three rows of camera_from_world.
hull::Silhouette read_camera(const std::string& line, const std::filesystem::path& folder) {
  std::istringstream words(line);
  std::string name;
  geometry::Pinhole k;
  Eigen::Matrix<double, 3, 4> rows;
  words >> name >> k.width_px >> k.height_px >> k.fx_px >> k.fy_px >> k.cx_px >> k.cy_px;
  for (int i = 0; i < 12; ++i) words >> rows(i / 4, i % 4);
  if (!words)
    throw std::runtime_error(fmt::format("{}: expected a name and 18 numbers, got: {}",
                                         (folder / "cameras.txt").string(), line));
  geometry::Camera camera{k, Eigen::Isometry3d::Identity()};
  camera.camera_from_world.matrix().topRows<3>() = rows;
  return {camera, hull::read_pbm(folder / (name + ".pbm"), k.width_px, k.height_px)};
}

// Reads the volume that `fivepipe maps` writes: a line with min and max.
Eigen::AlignedBox3d read_volume(const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / "volume.txt";
  std::ifstream file(path);
  std::string line;
  while (std::getline(file, line) && (line.empty() || line.front() == '#')) {
  }
  std::istringstream words(line);
  Vector3d min_m, max_m;
  for (Vector3d* const corner_m : {&min_m, &max_m})
    for (double& coordinate_m : *corner_m) words >> coordinate_m;
  if (!words || !(min_m.array() < max_m.array()).all())
    throw std::runtime_error(path.string() +
                             ": expected six numbers, min and max of the volume; write the maps "
                             "with `fivepipe maps`");
  return {min_m, max_m};
}

// Places the eye outside the volume, above it and to the side.
void see_whole_volume(HullScene& scene) {
  const Vector3d center_m = scene.volume_world_m.center();
  // The flattest image has the smallest angle, the vertical one.
  constexpr double kFlattest = 9.0 / 16;
  const double half_fov_rad = std::atan(kFlattest * std::tan(0.5 * scene.horizontal_fov_rad)),
               radius_m = 0.5 * scene.volume_world_m.diagonal().norm(),
               distance_m = radius_m / std::sin(half_fov_rad);
  scene.camera_from_world_of_eye =
      geometry::look_at(center_m + distance_m * Vector3d(0.5, -0.8, 0.45).normalized(), center_m);
  scene.near_m = distance_m - radius_m;
  scene.far_m = distance_m + radius_m;
}

}  // namespace

std::vector<hull::Capsule> hand_and_forearm() {
  std::vector<hull::Capsule> object{{{-0.02, 0, 0.1}, {-0.27, 0.02, 0.12}, 0.038}};
  for (const double y : {-0.03, -0.01, 0.01, 0.03})
    object.push_back({{0, 0.8 * y, 0.1}, {0.075, y, 0.1}, 0.014});
  const double lengths_m[] = {0.06, 0.075, 0.08, 0.07};
  for (int i = 0; i < 4; ++i) {
    const double y = -0.035 + 0.0233 * i;
    object.push_back({{0.08, y, 0.1}, {0.08 + lengths_m[i], 1.5 * y, 0.085 + 0.005 * i}, 0.009});
  }
  object.push_back({{0.02, -0.035, 0.1}, {0.07, -0.085, 0.09}, 0.011});
  return object;
}

HullScene hand_scene(const std::string& name, double map_fov_rad, double view_fov_rad) {
  HullScene scene = without_cameras(name, view_fov_rad);
  for (const double azimuth_deg : {35.0, 125.0, 215.0, 305.0})
    scene.silhouettes.push_back(seen(
        scene.object,
        {geometry::pinhole_from_fov(720, 486, map_fov_rad),
         geometry::look_at(
             kCenter + kCameraDistance_m * direction(azimuth_deg * kRadians, kCameraElevation_rad),
             kCenter)}));
  return scene;
}

HullScene ring_scene(const std::string& name, int cameras, int width_px, int height_px,
                     double map_fov_rad) {
  HullScene scene = without_cameras(name, 1.0);
  for (int i = 0; i < cameras; ++i) {
    const double elevation_rad = (25 + 20 * (i % 3)) * kRadians;
    scene.silhouettes.push_back(
        seen(scene.object,
             {geometry::pinhole_from_fov(width_px, height_px, map_fov_rad),
              geometry::look_at(
                  kCenter + kCameraDistance_m *
                                direction((35 + 360.0 * i / cameras) * kRadians, elevation_rad),
                  kCenter)}));
  }
  return scene;
}

// The fields of view give the coverage that the header states.
std::vector<HullScene> synthetic_scenes() {
  return {hand_scene("hand4", 0.68, 1.0),
          hand_scene("hand4-near", 0.395, 1.0),
          hand_scene("sparse", 0.68, 2.0),
          hand_scene("dense", 0.68, 0.46),
          ring_scene("hand16", 16, 1280, 720, 0.41),
          ring_scene("hand64", 64, 640, 480, 0.37)};
}

std::vector<HullScene> series_scenes() {
  std::vector<HullScene> scenes;
  for (const int cameras : {4, 8, 16, 32, 64})
    scenes.push_back(ring_scene("ring" + std::to_string(cameras), cameras, 720, 486, 0.5));
  for (const double fov_rad : {2.2, 1.6, 1.0, 0.7, 0.46})
    scenes.push_back(hand_scene("cover" + std::to_string(int(100 * fov_rad)), 0.68, fov_rad));
  return scenes;
}

HullScene real_scene(const std::filesystem::path& folder) {
  HullScene scene{folder.filename().string(), {}, {}, {}, 55 * kRadians, 0.3, 9.0, {}};
  if (scene.name == "seated4cam") {
    scene.camera_from_world_of_eye = geometry::look_at({1.70, -1.90, 1.50}, {0.30, 0.45, 0.75});
    scene.volume_world_m = {Vector3d(-0.3, -0.3, 0.0), Vector3d(1.0, 1.3, 1.6)};
  } else if (scene.name == "balance4cam") {
    scene.camera_from_world_of_eye = geometry::look_at({0.6, -2.6, 1.6}, {-1.0, 0.0, 0.85});
    scene.volume_world_m = {Vector3d(-2.2, -1.0, 0.0), Vector3d(0.4, 1.0, 2.0)};
  } else {
    scene.volume_world_m = read_volume(folder);
    see_whole_volume(scene);
  }
  std::ifstream cameras(folder / "cameras.txt");
  if (!cameras)
    throw std::runtime_error((folder / "cameras.txt").string() +
                             ": cannot read the file; `fivepipe maps` writes it");
  for (std::string line; std::getline(cameras, line);)
    if (!line.empty() && line.front() != '#')
      scene.silhouettes.push_back(read_camera(line, folder));
  if (scene.silhouettes.empty())
    throw std::runtime_error((folder / "cameras.txt").string() + ": lists no camera");
  return scene;
}

hull::View view_of(const HullScene& scene, int width_px, int height_px) {
  return {{geometry::pinhole_from_fov(width_px, height_px, scene.horizontal_fov_rad),
           scene.camera_from_world_of_eye},
          scene.near_m,
          scene.far_m};
}

double covered_fraction(const HullScene& scene) {
  double covered = 0, all = 0;
  for (const hull::Silhouette& s : scene.silhouettes) {
    covered += double(s.pixels.count());
    all += double(s.pixels.width_px()) * s.pixels.height_px();
  }
  return covered / all;
}

double pixel_footprint_m(const HullScene& scene) {
  double sum = 0;
  for (const hull::Silhouette& s : scene.silhouettes)
    sum += (geometry::camera_center_world_m(s.camera) - scene.volume_world_m.center()).norm() /
           s.camera.pinhole.fx_px;
  return sum / double(scene.silhouettes.size());
}

}  // namespace fivepipe::hull_bench
