// The response of a particle to a surface.
#pragma once
#include <Eigen/Core>

#include "common/config/objects/particle_source.h"

namespace fivepipe::sim {

// The tangent plane of a surface that a particle is near, at the end of a step.
struct SurfaceTouch {
  Eigen::Vector3d normal_world;  // unit, out of the surface
  double distance_m;             // from the plane to the particle's center; negative behind it
  Eigen::Vector3d velocity_world_m_s = Eigen::Vector3d::Zero();  // of the surface
};

// If the particle is nearer than its radius, moves it to that distance, without velocity. If it
// approaches the surface, it bounces, and Coulomb friction slows it along the surface. Returns true
// if it touched.
bool respond(const config::ParticleSource& source, const SurfaceTouch& touch,
             Eigen::Vector3d& p_world_m, Eigen::Vector3d& v_world_m_s);

}  // namespace fivepipe::sim
