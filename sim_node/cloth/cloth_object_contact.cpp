#include "sim_node/cloth/cloth_object_contact.h"

namespace fivepipe::sim {

ClothObjectContact::ClothObjectContact(const Cloth& cloth, const MovingObjects& objects,
                                       double thickness_m)
    : objects_(objects), thickness_m_(thickness_m), free_world_m_(cloth.vertices_world_m()) {}

void ClothObjectContact::reset(const Cloth& cloth) { free_world_m_ = cloth.vertices_world_m(); }

std::uint64_t ClothObjectContact::separate(Cloth& cloth) {
  std::uint64_t contacts = 0;
  const std::vector<MovingObjects::Swept> objects = objects_.swept(thickness_m_);
  for (std::size_t v = 0; v < free_world_m_.size(); ++v) {
    if (!(cloth.model().vertices[v].inverse_mass_1_kg > 0)) continue;
    for (const MovingObjects::Swept& object : objects) {
      const auto contact = object.contact(free_world_m_[v], cloth.vertices_world_m()[v]);
      if (!contact) continue;
      ++contacts;
      cloth.stop({.vertex = std::uint32_t(v),
                  .normal_world = contact->normal_world,
                  .missing_m = thickness_m_ - contact->distance_m,
                  .velocity_world_m_s = contact->velocity_world_m_s});
    }
    free_world_m_[v] = cloth.vertices_world_m()[v];
  }
  return contacts;
}

}  // namespace fivepipe::sim
