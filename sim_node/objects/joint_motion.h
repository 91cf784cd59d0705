// How an object moves on its joint.
#pragma once
#include <Eigen/Geometry>

#include "common/config/objects/joint.h"

namespace fivepipe::sim {

// An object's joint, and its pose where the joint is at 0.
struct Jointed {
  config::Joint joint;
  Eigen::Isometry3d start_world_from_object;

  Eigen::Vector3d axis_world() const { return start_world_from_object.linear() * joint.axis; }
  // Returns the position within the joint's limits that is nearest to a pose [rad or m].
  double position(const Eigen::Isometry3d& world_from_object) const;
  Eigen::Isometry3d pose(double position) const;
  // Returns the motion of the object's point p per unit of the joint's [m/rad or 1].
  Eigen::Vector3d rate(const Eigen::Vector3d& p_world_m) const;
};

// A contact that is nearer to a hinge's axis turns nothing [m].
inline constexpr double kMinJointLever_m = 0.02;

}  // namespace fivepipe::sim
