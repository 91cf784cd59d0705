// A reconstruction pipe's wiring: frame sets, colour and head poses in, hull tiles out.
#pragma once
#include "common/config/deployment.h"
#include "common/pipeline/node/run_node.h"

namespace fivepipe::recon {

// Runs until the node is told to stop, on `backend`, which is not `automatic`. Needs a current GL
// context where that does.
void run_reconstruction_pipe(node::NodeContext& node, config::HullBackend backend);

}  // namespace fivepipe::recon
