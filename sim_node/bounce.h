// What a virtual object does when it has been moved out of the visual hull: velocity after the
// response (paper, section 4.4, figure 5: "N_hull is used in the computation of the ball's
// direction after collision").
#pragma once
#include "common/collision/response/response.h"

namespace fivepipe::sim {

struct Bounce {
  Eigen::Vector3d move_world_m;
  Eigen::Vector3d velocity_world_m_s;
};

// Moves along V_rec by the response's clear distance, and by its residual where it is recovered.
// Where the object approaches, its velocity along N_hull (V_rec where the normal is not defined) is
// reversed with `restitution`, and with none below resting_speed_m_s, where a restitution would
// only show how often the hull is queried. The height gained by the move is paid for with that
// velocity as far as it goes: kinetic and potential energy grow by no more than the weight's lift,
// and not at all where the object fell in. The response's status is recovered or still_colliding.
Bounce bounce(const collision::Response& response, const Eigen::Vector3d& velocity_world_m_s,
              double restitution, double gravity_m_s2, double resting_speed_m_s);

}  // namespace fivepipe::sim
