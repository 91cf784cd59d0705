#include "launch/study/results/scene_parts.h"

#include <algorithm>
#include <cmath>

namespace fivepipe::study {
namespace {

using config::SceneObject;
using report::Part;

std::array<std::uint8_t, 3> rgb_of(const SceneObject& object) {
  std::array<std::uint8_t, 3> rgb{};
  for (std::size_t i = 0; i < 3; ++i)
    rgb[i] = std::uint8_t(std::lround(255 * std::clamp(object.colour_rgb[i], 0.0, 1.0)));
  return rgb;
}

geometry::Mesh in_world(const SceneObject& object) {
  geometry::Mesh mesh = config::mesh_of(object);
  for (Eigen::Vector3d& v : mesh.vertices_m) v = object.world_from_object * v;
  return mesh;
}

bool have_equal_axes(const Part& a, const Part& b) {
  if (!a.axis || !b.axis) return !a.axis && !b.axis;
  return a.axis->direction == b.axis->direction && a.axis->range == b.axis->range &&
         a.axis->mesh_spacing_m == b.axis->mesh_spacing_m;
}

}  // namespace

std::vector<Part> report_parts(const config::Scene& scene) {
  std::vector<Part> parts;
  for (const SceneObject& object : scene.objects) {
    if (!is_rigid(object)) continue;
    Part part{object.name, in_world(object), rgb_of(object)};
    if (object.spacing)
      part.axis = report::MovableAxis{object.spacing->axis_world,
                                      object.spacing->at_m,
                                      {object.spacing->low_m, object.spacing->high_m}};
    parts.push_back(std::move(part));
  }
  return parts;
}

bool are_equal(const std::vector<Part>& a, const std::vector<Part>& b) {
  return std::ranges::equal(a, b, [](const Part& one, const Part& other) {
    return one.name == other.name && one.mesh.vertices_m == other.mesh.vertices_m &&
           one.mesh.triangles == other.mesh.triangles && one.colour_rgb == other.colour_rgb &&
           one.was_in_recording == other.was_in_recording && have_equal_axes(one, other);
  });
}

Eigen::Isometry3d pose_at_zero(const SceneObject& object) {
  Eigen::Isometry3d at_zero = object.world_from_object;
  at_zero.translation() += object.spacing->move_world_m(0);
  return at_zero;
}

collision::MovablePart movable_part(const SceneObject& object) {
  return {config::mesh_of(object), pose_at_zero(object), object.spacing->axis_world};
}

}  // namespace fivepipe::study
