// The scene's particles: their sources, flight, and contact with the scene's objects and the hull
// (paper, section 4.5). Particles do not collide with each other.
#pragma once
#include <cstdint>
#include <vector>

#include "sim_node/particles/particle_hull_contact.h"
#include "sim_node/particles/particle_object_contact.h"
#include "sim_node/particles/particle_set.h"

namespace fivepipe::sim {

// Totals since construction.
struct ParticleCounters {
  std::uint64_t contacts = 0;    // with the hull: one per particle, part and step
  std::uint64_t stuck = 0;       // removed: HullTouches::leave() found no way out of the hull
  std::uint64_t not_finite = 0;  // removed
};

// Deterministic: the same calls give the same bits, with every instruction set.
class Particles {
 public:
  // Borrows its arguments, which must outlive this object. cloths: null if the scene has none.
  // Particles outside within_world_m vanish.
  Particles(const config::Scene& scene, const ObjectModels& models, const MovingObjects& rigid,
            const ClothObjects* cloths, const Eigen::AlignedBox3d& within_world_m);

  // Advances by step_s > 0. Call after the objects' step. steps_left: the steps up to the time of
  // the next report, at least 1, this one included. before_s: time from the step's end to the
  // hull's newest frame; negative after it.
  void step(double step_s, std::uint64_t steps_left, const CurrentHull& hull, double before_s);
  void forget(std::size_t cloth) { objects_.forget(cloth); }  // index in the scene; it has jumped
  void reset();  // removes all particles; the sources begin again

  // By position in the scene's particles.
  const ParticleSet& of_source(std::size_t i) const { return sources_[i].particles; }
  std::size_t count() const;  // of all sources
  // Contacts with the hull in the last step: one per particle and part.
  std::uint64_t hull_contacts() const { return hull_contacts_; }
  const ParticleCounters& counters() const { return counters_; }

 private:
  struct Source {
    config::ParticleSource source;
    ParticleEmitter emitter;
    ParticleSet particles = {};
  };
  void remove_old(Source& of);

  double gravity_m_s2_;
  Eigen::AlignedBox3d within_world_m_;
  std::vector<Source> sources_;
  ParticleObjectContact objects_;
  ParticleHullContact hull_;
  std::uint64_t hull_contacts_ = 0;
  ParticleCounters counters_;
};

}  // namespace fivepipe::sim
