#include "sim_node/proximity/proximity_fields.h"

#include <algorithm>

namespace fivepipe::sim {

bool warms_objects(const config::Scene& scene) {
  return std::any_of(scene.objects.begin(), scene.objects.end(),
                     [](const config::SceneObject& object) { return object.warming.has_value(); });
}

ProximityFields::ProximityFields(const config::Scene& scene, const ObjectModels& models,
                                 const RigidBodies& bodies, double step_s)
    : scene_(scene), models_(models), bodies_(bodies), step_s_(step_s) {
  for (std::size_t i = 0; i < scene.objects.size(); ++i)
    warmth_.push_back(scene.objects[i].warming
                          ? std::optional<Warmth>(std::in_place, *scene.objects[i].warming,
                                                  models.objects[i].bvh.mesh().vertices_m.size())
                          : std::nullopt);
}

void ProximityFields::clear() { shared_.clear(); }

collision::HullProximity& ProximityFields::proximity_to(const hull::HullQuery& query, double cap_m,
                                                        double tolerance_m) {
  for (SharedProximity& shared : shared_)
    if (shared.cap_m == cap_m && shared.tolerance_m == tolerance_m) return *shared.proximity;
  shared_.push_back({cap_m, tolerance_m,
                     std::make_unique<collision::HullProximity>(
                         query, collision::ProximityOptions{cap_m, tolerance_m})});
  return *shared_.back().proximity;
}

std::vector<collision::Proximity> ProximityFields::field(
    const hull::HullQuery& query, std::size_t object, const config::ProximityRequests& requests) {
  collision::HullProximity& proximity = proximity_to(query, requests.cap_m, requests.tolerance_m);
  const geometry::Mesh& mesh = models_.objects[object].bvh.mesh();
  const Eigen::Isometry3d world_from_object = bodies_.world_from_object(object);
  if (requests.of == config::ProximityOf::triangles)
    return proximity.of_mesh(mesh, world_from_object).triangles;
  std::vector<Eigen::Vector3d> vertices_world_m;
  for (const Eigen::Vector3d& v : mesh.vertices_m)
    vertices_world_m.push_back(world_from_object * v);
  std::vector<collision::Proximity> result(vertices_world_m.size());
  proximity.of_points(vertices_world_m, result);
  return result;
}

void ProximityFields::warm(const hull::HullQuery& query, std::uint64_t steps) {
  const double elapsed_s = double(steps - steps_warmed_) * step_s_;
  steps_warmed_ = steps;
  for (std::size_t i = 0; i < warmth_.size() && elapsed_s > 0; ++i) {
    if (!warmth_[i]) continue;
    const config::Warming& warming = *scene_.objects[i].warming;
    warmth_[i]->advance(elapsed_s, field(query, i,
                                         {.of = config::ProximityOf::vertices,
                                          .cap_m = warming.cap_m,
                                          .tolerance_m = warming.tolerance_m}));
  }
}

void ProximityFields::reset_warmth() {
  for (auto& warmth : warmth_)
    if (warmth) warmth->reset();
}

std::vector<float> ProximityFields::warmth(std::size_t object) const {
  return warmth_[object] ? warmth_[object]->vertices() : std::vector<float>{};
}

}  // namespace fivepipe::sim
