#include "sim_node/cloth/cloth_object_contact.h"

namespace fivepipe::sim {

ClothObjectContact::ClothObjectContact(const Cloth& cloth, const MovingObjects& objects,
                                       double thickness_m)
    : objects_(objects), thickness_m_(thickness_m), free_world_m_(cloth.vertices_world_m()) {}

void ClothObjectContact::reset(const Cloth& cloth) { free_world_m_ = cloth.vertices_world_m(); }

std::uint64_t ClothObjectContact::separate(Cloth& cloth, double step_s) {
  std::uint64_t contacts = 0;
  const std::vector<MovingObjects::Swept> objects = objects_.swept(thickness_m_);
  for (std::size_t v = 0; v < free_world_m_.size(); ++v) {
    if (!(cloth.model().vertices[v].inverse_mass_1_kg > 0)) continue;
    for (const MovingObjects::Swept& object : objects) {
      const Eigen::Vector3d p_m = cloth.vertices_world_m()[v];
      const auto contact = object.contact(free_world_m_[v], p_m);
      if (!contact) continue;
      ++contacts;
      cloth.stop({.vertex = std::uint32_t(v),
                  .normal_world = contact->normal_world,
                  .missing_m = thickness_m_ - contact->distance_m,
                  .slid_world_m = p_m - free_world_m_[v] - step_s * contact->velocity_world_m_s,
                  .velocity_world_m_s = contact->velocity_world_m_s});
    }
    free_world_m_[v] = cloth.vertices_world_m()[v];
  }
  return contacts;
}

}  // namespace fivepipe::sim
