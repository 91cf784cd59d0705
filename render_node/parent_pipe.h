// The parent pipe's wiring: tiles and virtual states in, composited frames out.
#pragma once
#include "common/pipeline/node/run_node.h"

namespace fivepipe::render {

// Runs until the node is told to stop or its window is closed. Needs a current GL context.
void run_parent_pipe(node::NodeContext& node);

}  // namespace fivepipe::render
