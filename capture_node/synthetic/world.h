// The real objects that synthetic cameras see. A person stands at y = -0.6 m and looks along +y
// over a table top at z = 0; config::SyntheticActor names what the person does.
#pragma once
#include <vector>

#include "common/config/capture_config.h"
#include "common/hull/oracle/analytic.h"

namespace fivepipe::capture {

enum class Material { skin, sleeve, pipe };

struct SyntheticPart {
  hull::Capsule capsule;
  Material material;
};

// Returns the parts at time t_s, in the world frame: always the same number in the same order.
// Periodic in t_s with world.period_s.
std::vector<SyntheticPart> synthetic_parts(const config::SyntheticWorld& world, double t_s);

// The actors. `turn` is the time in periods, 0 to 1.
//
// A right hand with its arm. It holds a pipe, 14 cm long and 4 cm thick as in the paper's payload
// task. The seed changes the fingers' phase, not the hand's path.
std::vector<SyntheticPart> hand_with_pipe(double turn, std::uint64_t seed);
// Two flat hands with their arms, back to back. They reach in at x = 0, move apart, and return
// (paper, figure 4).
std::vector<SyntheticPart> parting_hands(double turn);

// Adds an arm from the wrist to the shoulder: skin, then a sleeve. The elbow is on the side of
// `towards_elbow`.
void add_arm(std::vector<SyntheticPart>& parts, const Eigen::Vector3d& wrist_world_m,
             const Eigen::Vector3d& shoulder_world_m, const Eigen::Vector3d& towards_elbow);

}  // namespace fivepipe::capture
