// The particles of one source.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/config/objects/particle_source.h"

namespace fivepipe::sim {

// One entry per particle in each array, in no order.
struct ParticleSet {
  std::vector<Eigen::Vector3d> p_world_m, v_world_m_s;
  std::vector<Eigen::Vector3d> before_world_m;  // at the start of the last step
  std::vector<double> age_s;

  std::size_t size() const { return p_world_m.size(); }
  // age: in seconds.
  void add(const Eigen::Vector3d& p_m, const Eigen::Vector3d& v_m_s, double age);
  void remove(std::size_t i);  // the last particle takes its place
};

// Emits a source's particles at equal intervals. The n-th particle is always the same.
class ParticleEmitter {
 public:
  // position: of the source in the scene; the seed of its particles.
  ParticleEmitter(const config::ParticleSource& source, std::size_t position);

  // Adds the particles that start within the step of step_s up to now. Each moves at its initial
  // velocity for the rest of the step.
  void step(double step_s, ParticleSet& particles);
  void reset();  // begins again with the first particle

 private:
  // Returns a number that is uniform in [-1, 1), a function of the source, the particle and n.
  double random(std::uint64_t particle, std::uint64_t n) const;

  config::ParticleSource source_;
  std::uint64_t seed_;
  std::uint64_t steps_ = 0, emitted_ = 0;
};

// Free flight: gravity along -z and drag, by semi-implicit Euler. Sets before_world_m.
void fly(ParticleSet& particles, double step_s, double gravity_m_s2, double drag_1_s);

}  // namespace fivepipe::sim
