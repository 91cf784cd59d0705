#include "sim_node/hull/hull_part.h"

#include <algorithm>

#include "common/collision/tracking/rotation.h"

namespace fivepipe::sim {

Eigen::Isometry3d newest_from_before(const HullPart& part, double before_s) {
  const double moved_s = std::max(before_s, 0.0);
  const Eigen::Vector3d center_then_m = part.center_world_m - moved_s * part.velocity_world_m_s;
  return Eigen::Translation3d(part.center_world_m) *
         Eigen::Isometry3d(collision::rotation(moved_s * part.angular_velocity_world_rad_s)) *
         Eigen::Translation3d(-center_then_m);
}

RigidVelocity velocity_before(const HullPart& part, double before_s) {
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  if (!(before_s > 0)) return {part.center_world_m, zero, zero};
  return {part.center_world_m - before_s * part.velocity_world_m_s, part.velocity_world_m_s,
          part.angular_velocity_world_rad_s};
}

}  // namespace fivepipe::sim
