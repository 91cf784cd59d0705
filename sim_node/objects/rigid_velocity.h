// The velocity of a rigid body.
#pragma once
#include <Eigen/Geometry>

namespace fivepipe::sim {

// Velocities of the points of a rigid body [world].
struct RigidVelocity {
  Eigen::Vector3d center_world_m, velocity_world_m_s, angular_velocity_world_rad_s;
  Eigen::Vector3d at(const Eigen::Vector3d& p_world_m) const {
    return velocity_world_m_s + angular_velocity_world_rad_s.cross(p_world_m - center_world_m);
  }
};

}  // namespace fivepipe::sim
