// VirtualState out, Command in.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/pipeline/messages/wire_conversions.h"
#include "sim_node/simulation.h"

namespace fivepipe::sim {

// A VirtualState with the storage that it refers to. Only objects that move, or are warmed, are in
// it: the others stand in the scene.
struct OutgoingState {
  fivepipe_v1_VirtualState header{};
  std::vector<fivepipe_v1_ObjectState> objects;
  std::vector<std::vector<float>> vertices_m, warmth;  // by object
  const fivepipe_v1_VirtualState& message();
};
OutgoingState state_message(const std::string& simulation, std::uint64_t frame,
                            std::int64_t capture_stamp_ns, double simulation_time_s,
                            const config::Scene& scene, const std::vector<ObjectState>& states);

// Does what the command says where it is meant for this node, by name or for all.
void apply(const fivepipe_v1_Command& command, const std::string& node, Simulation& simulation);

}  // namespace fivepipe::sim
