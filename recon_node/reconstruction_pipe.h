// A reconstruction pipe's wiring: frame sets, colour and head poses in, hull tiles out.
#pragma once
#include "common/node/run_node.h"

namespace fivepipe {

// Runs until the node is told to stop. Needs a current GL context where its backend does.
void run_reconstruction_pipe(NodeContext& node);

}  // namespace fivepipe
