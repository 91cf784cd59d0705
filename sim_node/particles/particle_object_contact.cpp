#include "sim_node/particles/particle_object_contact.h"

#include <algorithm>

#include "sim_node/objects/solid_contact.h"
#include "sim_node/particles/particle_response.h"

namespace fivepipe::sim {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

ParticleObjectContact::ParticleObjectContact(const ObjectModels& models, const MovingObjects& rigid,
                                             const ClothObjects* cloths)
    : rigid_(rigid), cloths_(cloths) {
  if (!cloths_) return;
  for (std::size_t i = 0; i < cloths_->objects().size(); ++i) {
    const std::size_t object = cloths_->objects()[i];
    cloth_trees_.push_back({object, i, collision::Bvh(models.objects[object].bvh.mesh())});
  }
}

void ParticleObjectContact::forget(std::size_t object) {
  for (ClothTree& cloth : cloth_trees_)
    if (cloth.object == object) cloth.is_known = false;
}

void ParticleObjectContact::reset() {
  for (ClothTree& cloth : cloth_trees_) cloth.is_known = false;
}

void ParticleObjectContact::begin() {
  for (ClothTree& cloth : cloth_trees_) {
    const std::vector<Vector3d>& now_m = cloths_->cloth(cloth.position).vertices_world_m();
    cloth.before_world_m = cloth.is_known ? cloth.tree.mesh().vertices_m : now_m;
    cloth.is_known = true;
    cloth.tree.refit(now_m);
    cloth.moved_m = 0;
    for (std::size_t v = 0; v < now_m.size(); ++v)
      cloth.moved_m = std::max(cloth.moved_m, (now_m[v] - cloth.before_world_m[v]).norm());
  }
}

void ParticleObjectContact::step(const config::ParticleSource& source,
                                 ParticleSet& particles) const {
  for (const MovingObjects::Swept& object : rigid_.swept(source.radius_m))
    leave(object, source, particles);
  for (const ClothTree& cloth : cloth_trees_) leave(cloth, source, particles);
}

void ParticleObjectContact::leave(const MovingObjects::Swept& object,
                                  const config::ParticleSource& source,
                                  ParticleSet& particles) const {
  for (std::size_t i = 0; i < particles.size(); ++i) {
    Vector3d& p_m = particles.p_world_m[i];
    if (const auto contact = object.contact(particles.before_world_m[i], p_m))
      respond(source, *contact, p_m, particles.v_world_m_s[i]);
  }
}

void ParticleObjectContact::leave(const ClothTree& cloth, const config::ParticleSource& source,
                                  ParticleSet& particles) const {
  AlignedBox3d swept_m;
  for (const Vector3d& p_m : cloth.before_world_m) swept_m.extend(p_m);
  for (const Vector3d& p_m : cloth.tree.mesh().vertices_m) swept_m.extend(p_m);
  swept_m = {swept_m.min().array() - source.radius_m, swept_m.max().array() + source.radius_m};
  const std::vector<Vector3d>& velocities_m_s =
      cloths_->cloth(cloth.position).velocities_world_m_s();
  for (std::size_t i = 0; i < particles.size(); ++i) {
    Vector3d& p_m = particles.p_world_m[i];
    if (!may_meet(swept_m, particles.before_world_m[i], p_m)) continue;
    const auto found = mesh_contact(cloth.tree, cloth.before_world_m, cloth.moved_m,
                                    {particles.before_world_m[i], p_m, source.radius_m});
    if (!found) continue;
    const auto& [a, b, c] = cloth.tree.mesh().triangles[found->triangle];
    const Vector3d velocity_m_s = found->weights.x() * velocities_m_s[a] +
                                  found->weights.y() * velocities_m_s[b] +
                                  found->weights.z() * velocities_m_s[c];
    respond(source, {found->plane.normal, found->plane.distance_m, velocity_m_s}, p_m,
            particles.v_world_m_s[i]);
  }
}

}  // namespace fivepipe::sim
