#include "benchmarks/collision/scenes.h"

#include <numbers>
#include <stdexcept>

#include "benchmarks/collision/shapes.h"
#include "benchmarks/hull/scenes.h"

namespace fivepipe::collision_bench {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Translation3d;
using Eigen::Vector3d;

constexpr double kRadians = std::numbers::pi / 180;

std::vector<hull::Capsule> moved(std::vector<hull::Capsule> capsules, const Isometry3d& to_from) {
  for (hull::Capsule& c : capsules) c = {to_from * c.a_world_m, to_from * c.b_world_m, c.radius_m};
  return capsules;
}

// The hand of the hull benchmark, rotated about its wrist and moved to p. Unrotated, the fingers
// point along x and the palm down.
std::vector<hull::Capsule> hand_at(const Vector3d& p_world_m, const Eigen::Quaterniond& rotation) {
  return moved(hull_bench::hand_and_forearm(),
               Translation3d(p_world_m) * Isometry3d(rotation) * Translation3d(0, 0, -0.1));
}

SceneObject rigid(geometry::Mesh mesh, const Isometry3d& pose) {
  return {std::move(mesh), pose, false};
}
// The pose of a curtain laid flat and centered: its width along x, its height along y, its folds
// along z.
Isometry3d laid(double height_m, double z_m) {
  return Translation3d(0, -0.5 * height_m, z_m) *
         Isometry3d(AngleAxisd(90 * kRadians, Vector3d::UnitX()));
}

CollisionScene scene_of(const std::string& name, std::vector<hull::Capsule> real_objects,
                        const std::vector<geometry::Camera>& cameras,
                        std::vector<SceneObject> objects) {
  CollisionScene scene{name, std::move(real_objects),
                       {},   std::move(objects),
                       {},   {Vector3d(-1, -1, -0.4), Vector3d(1, 1, 1.2)}};
  for (const geometry::Camera& camera : cameras)
    scene.silhouettes.push_back(
        {camera, hull::true_object_pixels(scene.real_objects, camera, hull::PixelRule::touched)});
  for (const SceneObject& object : scene.objects)
    scene.objects_world_m.push_back(
        collision::world_triangles(object.mesh, object.world_from_mesh));
  return scene;
}

}  // namespace

std::size_t CollisionScene::triangles() const {
  std::size_t count = 0;
  for (const auto& object : objects_world_m) count += object.size();
  return count;
}

std::vector<geometry::Camera> paper_cameras() {
  const geometry::Pinhole k = geometry::pinhole_from_fov(720, 486, 58 * kRadians);
  return {{k, geometry::look_at({-2.05, 0.5, 1.5}, {0.0, 0.0, 0.3})},
          {k, geometry::look_at({0.35, 2.05, 1.3}, {0.0, 0.0, 0.38})},
          {k, geometry::look_at({2.0, -0.85, 1.5}, {0.0, 0.0, 0.28})}};
}

std::vector<geometry::Camera> table_cameras() {
  const geometry::Pinhole k = geometry::pinhole_from_fov(720, 486, 58 * kRadians);
  return {
      {k, geometry::look_at({-1.9, -1.0, 1.5}, {-0.05, -0.02, 0.27})},
      {k, geometry::look_at({-0.25, 2.0, 1.45}, {0.0, 0.0, 0.38})},
      {k, geometry::look_at({2.0, -0.7, 1.55}, {0.05, 0.0, 0.28})},
      {{720, 486, 620, 620, 359.5, 410}, geometry::look_at({2.3, 0.55, 0.03}, {0.0, 0.0, 0.03})}};
}

CollisionScene curtain720() {
  // The back of the hand faces the curtain; the hand points up along it and slightly across.
  const Eigen::Quaterniond rotation =
      AngleAxisd(60 * kRadians, -Vector3d::UnitY()) *
      Eigen::Quaterniond(AngleAxisd(90 * kRadians, Vector3d::UnitX()));
  return scene_of("curtain720", hand_at({0.02, 0.03, 0.35}, rotation), paper_cameras(),
                  {{geometry::curtain_mesh(0.6, 0.6, 20, 18, 0.015, 4), at(0, 0, 0.62), true}});
}

CollisionScene blocks() {
  std::vector<SceneObject> objects;
  for (int i = 0; i < 12; ++i) {
    const Vector3d size_m(0.06 + 0.02 * (i % 3), 0.05 + 0.015 * (i % 4), 0.04 + 0.03 * (i % 3));
    objects.push_back(rigid(geometry::box_mesh(size_m),
                            at(-0.2 + 0.13 * (i % 4), -0.13 + 0.12 * (i / 4), 0.5 * size_m.z()) *
                                AngleAxisd(0.5 * i, Vector3d::UnitZ())));
  }
  return scene_of(
      "blocks",
      hand_at({0.0, -0.02, 0.06}, Eigen::Quaterniond(AngleAxisd(20 * kRadians, Vector3d::UnitZ()))),
      table_cameras(), std::move(objects));
}

CollisionScene payload() {
  const Eigen::Quaterniond rotation =
      AngleAxisd(100 * kRadians, Vector3d::UnitZ()) *
      Eigen::Quaterniond(AngleAxisd(15 * kRadians, Vector3d::UnitY()));
  return scene_of("payload", hand_at({0.13, -0.14, 0.2}, rotation), table_cameras(),
                  {rigid(payload_mesh(50000), at(0, 0, 0))});
}

CollisionScene dense() {
  const double height_m = 0.6;
  return scene_of(
      "dense",
      hand_at({0, 0, 0.1635}, Eigen::Quaterniond(AngleAxisd(25 * kRadians, Vector3d::UnitY()))),
      table_cameras(),
      {rigid(geometry::curtain_mesh(0.8, height_m, 1000, 500, 0.004, 6), laid(height_m, 0.08))});
}

CollisionScene full() {
  constexpr int kColumns = 8, kRows = 5;
  constexpr double kLeg_m = 0.06, kPlate_m = 0.1;
  const SceneObject plate =
      rigid(geometry::curtain_mesh(kColumns * kLeg_m, kRows * kLeg_m, kColumns, kRows, 0, 0),
            laid(kRows * kLeg_m, kPlate_m));
  std::vector<hull::Capsule> fingers;
  for (const collision::Triangle& t :
       collision::world_triangles(plate.mesh, plate.world_from_mesh)) {
    const Vector3d center = (t[0] + t[1] + t[2]) / 3;
    fingers.push_back({center - Vector3d(0, 0, 0.01), center + Vector3d(0, 0, 0.01), 0.008});
  }
  return scene_of("full", std::move(fingers), table_cameras(), {plate});
}

CollisionScene thin() {
  constexpr double kSide_m = 0.2, kPlate_m = 0.1;
  std::vector<geometry::Camera> cameras = table_cameras();
  for (geometry::Camera& c : cameras)
    c = {geometry::pinhole_from_fov(720, 486, 9 * kRadians),
         geometry::look_at(geometry::camera_center_world_m(c), {0, 0, kPlate_m})};
  std::vector<hull::Capsule> fingers;
  for (int i = 0; i < 12; ++i) {
    const Vector3d center(-0.075 + 0.053 * (i % 4), -0.07 + 0.071 * (i / 4), kPlate_m),
        half_m(0.002 * i, 0.01, 0.03);
    fingers.push_back({center - half_m, center + half_m, 0.001});
  }
  return scene_of(
      "thin", std::move(fingers), cameras,
      {rigid(geometry::curtain_mesh(kSide_m, kSide_m, 10, 10, 0, 0), laid(kSide_m, kPlate_m))});
}

CollisionScene real_scene(const std::filesystem::path& folder) {
  const hull_bench::HullScene maps = hull_bench::real_scene(folder);
  if (maps.name != "seated4cam")
    throw std::runtime_error(folder.string() +
                             ": the collision benchmark has virtual objects for seated4cam only");
  CollisionScene scene =
      scene_of("real", {}, {},
               {rigid(chair_mesh(), at(0.35, 0.45, 0)), rigid(chair_mesh(), at(1.1, 0.5, 0)),
                rigid(table_mesh(1.2, 0.7, 0.72), at(0.35, -0.1, 0))});
  scene.silhouettes = maps.silhouettes;
  scene.volume_world_m = maps.volume_world_m;
  return scene;
}

}  // namespace fivepipe::collision_bench
