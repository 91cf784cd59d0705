// Velocity of a virtual object after the collision response (paper, section 4.4 and figure 5:
// "N_hull is used in the computation of the ball's direction after collision").
#pragma once
#include "common/collision/response/response.h"

namespace fivepipe::sim {

struct Bounce {
  Eigen::Vector3d move_world_m;
  Eigen::Vector3d velocity_world_m_s;
};

// Computes the move and the velocity after it, for gravity along -z. The response must have an exit
// (has_exit()).
//
// The move goes along V_rec by the clear distance, plus the residual if the object is recovered. If
// the object approaches, the velocity component along N_hull (V_rec if the normal is undefined) is
// reversed and multiplied by `restitution`. Below resting_speed_m_s the restitution is 0, because a
// bounce that slow depends on the period of the hull queries. The reversed speed is first reduced
// by the energy that the lift of the move adds: kinetic plus potential energy grows at most by the
// potential energy of the lift, and not at all if that speed suffices.
Bounce bounce(const collision::Response& response, const Eigen::Vector3d& velocity_world_m_s,
              double restitution, double gravity_m_s2, double resting_speed_m_s);

}  // namespace fivepipe::sim
