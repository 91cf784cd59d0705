#include "sim_node/objects/joint_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fivepipe::sim {

using Eigen::Isometry3d;
using Eigen::Vector3d;

double Jointed::position(const Isometry3d& world_from_object) const {
  const Isometry3d& start = start_world_from_object;
  double free;
  if (joint.kind == config::JointKind::hinge) {
    const Eigen::Quaterniond turn(world_from_object.linear() * start.linear().transpose());
    const double angle_rad = 2 * std::atan2(turn.vec().dot(axis_world()), turn.w()),
                 middle_rad = 0.5 * (joint.lowest + joint.highest);
    free = middle_rad + std::remainder(angle_rad - middle_rad, 2 * std::numbers::pi);
  } else {
    free = axis_world().dot(world_from_object.translation() - start.translation());
  }
  return std::clamp(free, joint.lowest, joint.highest);
}

Isometry3d Jointed::pose(double position) const {
  const Isometry3d& start = start_world_from_object;
  if (joint.kind == config::JointKind::slider)
    return Eigen::Translation3d(position * axis_world()) * start;
  const Vector3d point_m = start * joint.point_m;
  return Eigen::Translation3d(point_m) * Eigen::AngleAxisd(position, axis_world()) *
         Eigen::Translation3d(-point_m) * start;
}

Vector3d Jointed::rate(const Vector3d& p_world_m) const {
  if (joint.kind == config::JointKind::slider) return axis_world();
  return axis_world().cross(p_world_m - start_world_from_object * joint.point_m);
}

}  // namespace fivepipe::sim
