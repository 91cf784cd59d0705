// The capture node: captures the cameras, segments object pixels and publishes the head pose.
#include "capture_node/video_pipe.h"

int main(int argc, char** argv) {
  return fivepipe::node::run_node("capture_node", argc, argv, fivepipe::capture::run_video_pipe);
}
