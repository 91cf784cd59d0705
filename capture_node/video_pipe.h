// The capture node's wiring: reads images, publishes head poses, colours and object-pixel maps.
#pragma once
#include "common/pipeline/node/run_node.h"

namespace fivepipe::capture {

// Runs until the node is stopped or the file of a camera that does not loop has ended. Throws
// NodeFailure: exit code 3 if a camera device is missing, 2 if a file cannot be used.
void run_video_pipe(node::NodeContext& node);

}  // namespace fivepipe::capture
