// Wires a reconstruction pipe: reads frame sets, colour and head poses, writes hull tiles.
#pragma once
#include "common/config/deployment.h"
#include "common/pipeline/node/run_node.h"

namespace fivepipe::recon {

// Returns after a stop signal. `backend` must not be `automatic`. Needs a current GL context if the
// backend does.
void run_reconstruction_pipe(node::NodeContext& node, config::HullBackend backend);

}  // namespace fivepipe::recon
