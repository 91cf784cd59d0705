#include "sim_node/contact/bounce.h"

#include <algorithm>
#include <cmath>

namespace fivepipe::sim {

Bounce bounce(const collision::Response& response, const Eigen::Vector3d& velocity_world_m_s,
              double restitution, double gravity_m_s2, double resting_speed_m_s) {
  // The move clears a residual below the maps' resolution too. A larger residual is another
  // contact, which the next query handles.
  const double distance_m =
      response.clear_distance_m() +
      (response.status == collision::RecoveryStatus::recovered ? response.residual_m : 0.0);
  Bounce result{distance_m * response.v_rec_world, velocity_world_m_s};
  const collision::HullNormal& hull = response.normal();
  const Eigen::Vector3d& normal =
      hull.status == collision::NormalStatus::defined ? hull.normal_world : response.v_rec_world;
  const double approach_m_s = -velocity_world_m_s.dot(normal);
  if (!(approach_m_s > 0)) return result;
  const double lift_m = std::max(0.0, result.move_world_m.z());
  const double speed_after_lift_m_s =
      std::sqrt(std::max(0.0, approach_m_s * approach_m_s - 2 * gravity_m_s2 * lift_m));
  const double away_m_s =
      approach_m_s > resting_speed_m_s ? restitution * speed_after_lift_m_s : 0.0;
  result.velocity_world_m_s += (approach_m_s + away_m_s) * normal;
  return result;
}

}  // namespace fivepipe::sim
