#include "capture_node/synthetic/world.h"

#include <cmath>

#include "capture_node/synthetic/actors/actors.h"

namespace fivepipe::capture {

std::vector<SyntheticPart> synthetic_parts(const config::SyntheticWorld& world, double t_s) {
  const double periods = t_s / world.period_s, turn = periods - std::floor(periods);
  switch (world.actor) {
    case config::SyntheticActor::hand_with_pipe: return hand_with_pipe(turn, world.seed);
    case config::SyntheticActor::parting_hands: return parting_hands(turn);
    case config::SyntheticActor::hand_with_tray: return hand_with_tray(turn);
    case config::SyntheticActor::pushing_hand: return pushing_hand(turn);
    case config::SyntheticActor::catching_hand: return catching_hand(turn);
    case config::SyntheticActor::pipe_task:
      return pipe_task(turn, world.hand_length_m, world.tool == config::SyntheticTool::tongs);
    case config::SyntheticActor::reaching_arm:
      return reaching_arm(turn, world.hand_length_m, false);
    case config::SyntheticActor::reaching_and_leaning:
      return reaching_arm(turn, world.hand_length_m, true);
  }
  return {};
}

}  // namespace fivepipe::capture
