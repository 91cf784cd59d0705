// The wiring of every capture node but the first one of a deployment: captures its cameras whenever
// the first capture node publishes the head pose of a frame, with the number of that frame.
#pragma once
#include "common/pipeline/node/run_node.h"

namespace fivepipe::capture {

// Runs until the node is stopped or the file of a camera that does not loop has ended. Throws
// SourceError or HardwareMissing.
void run_following_pipe(node::NodeContext& node);

}  // namespace fivepipe::capture
