// The simulation pipe's wiring: frame sets and commands in, collision results and virtual states
// out.
#pragma once
#include "common/pipeline/node/run_node.h"

namespace fivepipe::sim {

// Runs until the node is told to stop. Needs a current GL context.
void run_simulation_pipe(node::NodeContext& node);

}  // namespace fivepipe::sim
