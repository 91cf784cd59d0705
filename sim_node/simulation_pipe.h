// Wiring of the simulation pipe: reads frame sets and commands, writes collision results and
// virtual states.
#pragma once
#include "common/pipeline/node/run_node.h"

namespace fivepipe::sim {

// Runs until the node is stopped. Needs a current OpenGL context if the collision backend is gl or
// paper.
void run_simulation_pipe(node::NodeContext& node);

}  // namespace fivepipe::sim
