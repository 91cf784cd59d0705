// The video pipe's wiring: images in, head pose, colour and object-pixel maps out.
#pragma once
#include "common/pipeline/node/run_node.h"

namespace fivepipe::capture {

// Runs until the node is told to stop or a file that is not looped has ended. Throws NodeFailure
// with exit code 3 where a camera is not there, SourceError where a file can't be used.
void run_video_pipe(node::NodeContext& node);

}  // namespace fivepipe::capture
