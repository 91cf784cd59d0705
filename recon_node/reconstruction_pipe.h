// A reconstruction pipe's wiring: frame sets, colour and head poses in, hull tiles out.
#pragma once
#include "common/node/run_node.h"
#include "common/scene/deployment.h"

namespace fivepipe {

// Runs until the node is told to stop, on `backend`, which is not `automatic`. Needs a current GL context where that does.
void run_reconstruction_pipe(NodeContext& node, HullBackend backend);

}  // namespace fivepipe
