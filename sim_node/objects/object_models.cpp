#include "sim_node/objects/object_models.h"

#include <algorithm>
#include <cmath>

namespace fivepipe::sim {
namespace {

double radius_m(const geometry::Mesh& mesh) {
  const Eigen::Vector3d center_m = geometry::bounds_m(mesh).center();
  double radius_sq = 0;
  for (const Eigen::Vector3d& v : mesh.vertices_m)
    radius_sq = std::max(radius_sq, (v - center_m).squaredNorm());
  return std::sqrt(radius_sq);
}

// Only a ball's triangles approximate another surface; other meshes are their own surface.
double flatness_m(const config::SceneObject& object, const geometry::Mesh& mesh) {
  const auto* sphere = std::get_if<config::SphereShape>(&object.shape);
  if (!sphere) return 0;
  double nearest_m = sphere->radius_m;
  for (const auto& [a, b, c] : mesh.triangles)
    nearest_m = std::min(nearest_m,
                         (mesh.vertices_m[a] + mesh.vertices_m[b] + mesh.vertices_m[c]).norm() / 3);
  return sphere->radius_m - nearest_m;
}

}  // namespace

ObjectModels object_models(const config::Scene& scene) {
  ObjectModels models;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const config::SceneObject& object = scene.objects[i];
    collision::Bvh bvh(config::mesh_of(object));
    const geometry::Mesh& mesh = bvh.mesh();
    Eigen::AlignedBox3d start_m;
    for (const Eigen::Vector3d& v : mesh.vertices_m) start_m.extend(object.world_from_object * v);
    models.start_bounds_m.extend(start_m);
    if (object.spacing && !start_m.isEmpty())
      for (const double end_m : {object.spacing->low_m, object.spacing->high_m})
        models.start_bounds_m.extend(start_m.translated(object.spacing->move_world_m(end_m)));
    if (config::is_reported(object)) models.reacting.push_back(i);
    if (object.motion == config::Motion::dynamic) {
      if (object.reaction == config::Reaction::bounce) models.bouncing.push_back(i);
      if (object.reaction == config::Reaction::contact) models.touching.push_back(i);
    }
    const double radius = radius_m(mesh), flatness = flatness_m(object, mesh);
    models.objects.push_back({std::move(bvh), radius, flatness});
  }
  return models;
}

}  // namespace fivepipe::sim
