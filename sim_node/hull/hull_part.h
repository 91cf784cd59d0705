// Motion of the hull's parts between two frames. The simulation takes smaller steps than the
// frames, so a part is interpolated: it moves rigidly from its place at the previous frame to that
// at the newest one.
#pragma once
#include <Eigen/Geometry>
#include <cstdint>
#include <limits>

#include "sim_node/objects/rigid_velocity.h"

namespace fivepipe::sim {

// A tracked component of the hull, or the whole hull at rest.
struct HullPart {
  std::uint64_t id = 0;  // TrackedComponent::id; 0: the whole hull
  // At the newest frame; contains the part.
  Eigen::AlignedBox3d box_world_m{
      Eigen::Vector3d::Constant(-std::numeric_limits<double>::infinity()),
      Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity())};
  // The part rotates about this point, which moves at the velocity. At the newest frame.
  Eigen::Vector3d center_world_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_world_m_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_velocity_world_rad_s = Eigen::Vector3d::Zero();
};

// Returns the motion of the part from its place `before_s` before the newest frame to that at the
// newest frame. After the newest frame (before_s < 0), the part rests.
Eigen::Isometry3d newest_from_before(const HullPart& part, double before_s);

// Zero at the newest frame and after it.
RigidVelocity velocity_before(const HullPart& part, double before_s);

}  // namespace fivepipe::sim
