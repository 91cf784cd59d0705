// The response of a particle to a surface.
#pragma once
#include <Eigen/Core>

#include "common/config/objects/particle_source.h"
#include "sim_node/objects/moving_objects.h"

namespace fivepipe::sim {

// If the particle is nearer than its radius, moves it to that distance, without velocity. If it
// approaches the surface, it bounces, and Coulomb friction slows it along the surface. Returns true
// if it touched.
bool respond(const config::ParticleSource& source, const SurfaceContact& contact,
             Eigen::Vector3d& p_world_m, Eigen::Vector3d& v_world_m_s);

}  // namespace fivepipe::sim
