#include "sim_node/simulation/simulation_metrics.h"

#include <algorithm>

namespace fivepipe::sim {
namespace {

Energy energy_of(const Cloth& cloth, double gravity_m_s2) {
  Energy energy;
  for (std::size_t i = 0; i < cloth.vertices_world_m().size(); ++i) {
    const double inverse_mass_1_kg = cloth.model().vertices[i].inverse_mass_1_kg;
    if (!(inverse_mass_1_kg > 0)) continue;
    energy.kinetic_j += 0.5 * cloth.velocities_world_m_s()[i].squaredNorm() / inverse_mass_1_kg;
    energy.potential_j += gravity_m_s2 * cloth.vertices_world_m()[i].z() / inverse_mass_1_kg;
  }
  return energy;
}

void add(HullContacts& sum, const HullContacts& other) {
  sum.count += other.count;
  sum.deepest_m = std::max(sum.deepest_m, other.deepest_m);
}

}  // namespace

std::optional<BodyMetrics> body_metrics(const config::Scene& scene, const RigidBodies& bodies,
                                        const HullContacts& bouncing,
                                        const HullContacts& touching) {
  BodyMetrics metrics{.hull = bouncing};
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const config::SceneObject& object = scene.objects[i];
    if (object.motion != config::Motion::dynamic) continue;
    ++metrics.bodies;
    metrics.energy.kinetic_j += bodies.kinetic_energy_j(i);
    metrics.energy.potential_j +=
        object.mass_kg * scene.gravity_m_s2 * bodies.center_world_m(i).z();
  }
  if (metrics.bodies == 0) return std::nullopt;
  add(metrics.hull, touching);
  metrics.each_other = bodies.contacts();
  return metrics;
}

ClothMetrics cloth_metrics(const ClothObjects& cloths, double gravity_m_s2) {
  ClothMetrics metrics{.cloths = cloths.objects().size()};
  for (std::size_t i = 0; i < metrics.cloths; ++i) {
    const Energy energy = energy_of(cloths.cloth(i), gravity_m_s2);
    metrics.energy.kinetic_j += energy.kinetic_j;
    metrics.energy.potential_j += energy.potential_j;
    add(metrics.hull, cloths.hull_contacts(i));
  }
  return metrics;
}

}  // namespace fivepipe::sim
