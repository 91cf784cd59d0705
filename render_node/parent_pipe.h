// Wires the parent pipe: reads tiles and virtual states, writes composited frames.
#pragma once
#include "common/pipeline/node/run_node.h"

namespace fivepipe::render {

// Returns after a stop signal or after the user closes the window. Needs a current GL context.
void run_parent_pipe(node::NodeContext& node);

}  // namespace fivepipe::render
