// Energy, penetration and contacts of the virtual objects at the time of a simulation. They cost
// one pass over the objects, the vertices of the cloths and the contacts that the solvers keep.
#pragma once
#include <optional>

#include "sim_node/cloth/cloth_objects.h"
#include "sim_node/contact/hull_manifolds.h"
#include "sim_node/contact/rigid_contact.h"
#include "sim_node/objects/rigid_bodies.h"
#include "sim_node/particles/particles.h"

namespace fivepipe::sim {

// Without elastic energy. The potential is that of gravity, 0 at z = 0.
struct Energy {
  double kinetic_j = 0, potential_j = 0;
};
// The dynamic objects.
struct BodyMetrics {
  std::size_t bodies = 0;
  Energy energy = {};
  HullContacts hull = {};  // reaction `contact`: HullManifolds; `bounce`: RigidContact
  BodyContacts each_other = {};
};
struct ClothMetrics {
  std::size_t cloths = 0;
  Energy energy = {};  // without the fixed vertices
  HullContacts hull = {};
};
struct ParticleMetrics {
  std::size_t particles = 0;
  std::uint64_t hull_contacts = 0;
};
// Each is absent if the scene has no such object.
struct SimulationMetrics {
  std::optional<BodyMetrics> bodies;
  std::optional<ClothMetrics> cloths;
  std::optional<ParticleMetrics> particles;
};

// Returns nullopt if the scene has no dynamic object. bouncing, touching: the contacts with the
// hull of the objects with reaction `bounce` and `contact`.
std::optional<BodyMetrics> body_metrics(const config::Scene& scene, const RigidBodies& bodies,
                                        const HullContacts& bouncing, const HullContacts& touching);
ClothMetrics cloth_metrics(const ClothObjects& cloths, double gravity_m_s2);

}  // namespace fivepipe::sim
