#include "sim_node/particles/particle_response.h"

#include <algorithm>

#include "sim_node/objects/rigid_bodies.h"

namespace fivepipe::sim {

bool respond(const config::ParticleSource& source, const SurfaceContact& contact,
             Eigen::Vector3d& p_world_m, Eigen::Vector3d& v_world_m_s) {
  if (!(contact.distance_m < source.radius_m)) return false;
  const Eigen::Vector3d& normal = contact.normal_world;
  p_world_m += (source.radius_m - contact.distance_m) * normal;
  Eigen::Vector3d v_m_s = v_world_m_s - contact.velocity_world_m_s;  // relative to the surface
  const double approach_m_s = -normal.dot(v_m_s);
  if (!(approach_m_s > 0)) return true;
  const double restitution = approach_m_s > kMinBounce_m_s ? source.restitution : 0,
               impulse_m_s = (1 + restitution) * approach_m_s;
  v_m_s += approach_m_s * normal;  // along the surface
  const double along_m_s = v_m_s.norm();
  if (along_m_s > 0) v_m_s *= std::max(0.0, 1 - source.friction * impulse_m_s / along_m_s);
  v_world_m_s = contact.velocity_world_m_s + v_m_s + restitution * approach_m_s * normal;
  return true;
}

}  // namespace fivepipe::sim
