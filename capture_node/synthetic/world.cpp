#include "capture_node/synthetic/world.h"

#include <cmath>

namespace fivepipe::capture {

std::vector<SyntheticPart> synthetic_parts(const config::SyntheticWorld& world, double t_s) {
  const double periods = t_s / world.period_s, turn = periods - std::floor(periods);
  switch (world.actor) {
    case config::SyntheticActor::hand_with_pipe: return hand_with_pipe(turn, world.seed);
    case config::SyntheticActor::parting_hands: return parting_hands(turn);
  }
  return {};
}

void add_arm(std::vector<SyntheticPart>& parts, const Eigen::Vector3d& wrist_world_m,
             const Eigen::Vector3d& shoulder_world_m, const Eigen::Vector3d& towards_elbow) {
  constexpr double kForearm_m = 0.26;
  const Eigen::Vector3d to_shoulder = (shoulder_world_m - wrist_world_m).normalized();
  const Eigen::Vector3d elbow =
      wrist_world_m + kForearm_m * (to_shoulder + towards_elbow).normalized();
  const Eigen::Vector3d sleeve_edge = wrist_world_m + 0.4 * (elbow - wrist_world_m);
  parts.push_back({{wrist_world_m, sleeve_edge, 0.026}, Material::skin});
  parts.push_back({{sleeve_edge, elbow, 0.038}, Material::sleeve});
  parts.push_back({{elbow, shoulder_world_m, 0.046}, Material::sleeve});
}

}  // namespace fivepipe::capture
