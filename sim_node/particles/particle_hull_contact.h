// Contact of particles with the hull.
//
// In each step, the distance transforms of the silhouettes (hull_distance.h) give the surface near
// each particle. If a part moves (scene `history`), the query maps each particle to the part's
// place at the newest frame, and the surface has the part's velocity. After the last step of a
// frame, the exact query of the hull finds the particles that are still inside; these leave along
// exact rays.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "common/hull/silhouette/hull_distance.h"
#include "sim_node/hull/current_hull.h"
#include "sim_node/particles/particle_set.h"

namespace fivepipe::sim {

class ParticleHullContact {
 public:
  // Call before step(), for all sources. Takes the hull's newest frame, which is before_s after the
  // end of the step (negative: before it). Requires hull.query().
  void begin(const CurrentHull& hull, double step_s, double before_s);
  // Moves the particles out of the hull. Returns the number of contacts: one per particle and part.
  std::uint64_t step(const config::ParticleSource& source, ParticleSet& particles) const;
  // Call after the last step of a frame. Moves the particles that are still in the newest hull out
  // of it, by at most four moves of at most kMaxParticleExit_m, and removes those for which that is
  // not enough. Returns the number of removed particles.
  std::uint64_t leave(const hull::HullQuery& query, ParticleSet& particles) const;

 private:
  struct PlacedPart {
    Eigen::AlignedBox3d box_world_m;  // at the newest frame
    Eigen::Isometry3d newest_from_end;
    RigidVelocity velocity;
  };
  std::uint64_t frame_ = 0;
  std::optional<hull::HullDistance> distance_;  // of the newest frame
  std::vector<PlacedPart> parts_;
};

// More than half the thickness of a forearm.
inline constexpr double kMaxParticleExit_m = 0.1;

}  // namespace fivepipe::sim
