// What the person at the table does. `turn` is the time in periods, 0 to 1. Each actor returns
// always the same number of parts in the same order.
#pragma once
#include <cstdint>
#include <vector>

#include "capture_node/synthetic/actors/part.h"

namespace fivepipe::capture {

// A right hand with its arm. It holds a pipe, 14 cm long and 4 cm thick as in the paper's payload
// task. The seed changes the fingers' phase, not the hand's path.
std::vector<SyntheticPart> hand_with_pipe(double turn, std::uint64_t seed);

// Two flat hands with their arms, back to back. They reach in at x = 0, move apart, and return
// (paper, figure 4).
std::vector<SyntheticPart> parting_hands(double turn);

// Two wooden blocks stand on the table. A hand beside them holds a wooden tray; it lowers the tray
// and throws the objects on it upwards: with a period of 8 s at up to 1.4 m/s.
std::vector<SyntheticPart> hand_with_tray(double turn);

// A flat hand, fingers up, pushes away from the person, 0.3 m at x = 0.1 and z = 0.3 m, and
// returns.
std::vector<SyntheticPart> pushing_hand(double turn);

// A flat hand, palm up. It moves to x = 0, y = 0, stays there, throws the objects on it upwards
// (with a period of 8 s at up to 1.1 m/s), and draws back.
std::vector<SyntheticPart> catching_hand(double turn);

// The paper's payload task (section 5.2.2): a right hand slides a pipe, 14 cm long and 4 cm wide,
// between the virtual payloads of scenes/payload, lowers it into the shaft of the PMT box, screws
// it into a real connector, feeds the power cord down the pipe and plugs it in; in the second half
// of the period, it undoes this in reverse order. The cord is stiff and the fingers push it; with
// tongs, it is flexible and the tongs hold its plug. hand_length_m: from the wrist to the tip of
// the middle finger; the arm has the same proportions.
std::vector<SyntheticPart> pipe_task(double turn, double hand_length_m, bool with_tongs);

// A left arm reaches, at most as far as it is long, between the parts of scenes/engine to the oil
// filter, stays there from 0.4 to 0.6 and returns. leans: the right hand leans on the table, behind
// the battery.
std::vector<SyntheticPart> reaching_arm(double turn, double hand_length_m, bool leans);

}  // namespace fivepipe::capture
