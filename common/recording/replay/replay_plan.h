// What a replay sends, to which nodes, and how fast.
#pragma once
#include <chrono>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/recording/files/recording.h"

namespace fivepipe::replay {

// A node that receives replayed inputs.
struct ReplayedNode {
  std::string name, program;
  std::set<std::string> inputs = {};  // topics that it reads: inputs_of() (node_inputs.h)
  // Of a render_node: names of the views whose tiles complete a frame: hull_view_names().
  std::set<std::string> hull_views = {};
};

// In which order a lossless replay sends the messages of a frame to the nodes.
enum class SendOrder {
  // The replay sends messages that trigger work after the nodes have all other messages of the
  // frame, so every run has the same output.
  inputs_first,
  // Like inputs_first. At an unlimited rate, the replay sends the other messages of the next frame
  // while the nodes still work on the current one.
  pipelined,
  // The replay sends the messages one after the other without waiting, as capture_node does.
  as_captured,
};

struct ReplayPlan {
  std::set<mcap::Id> channels;  // of the recording
  // Log stamps, both included. Latched messages before the start are sent first.
  std::int64_t start_ns = 0, end_ns = 0;
  double rate = 1;  // 1: as recorded; 0: unlimited
  // Writers block until their readers have everything, and the messages of a frame are sent
  // together, in the order in which the nodes need them.
  bool lossless = false;
  // If lossless: at most `frames_in_flight` frames are at these nodes. A node has handled a frame
  // when it publishes the frame's FrameTrace.
  std::vector<ReplayedNode> nodes;
  int frames_in_flight = 2;
  SendOrder order = SendOrder::inputs_first;
  std::size_t shape_cameras = 0;  // maps per frame set, for nodes that wait for complete sets
  // Maximum wait for a reader, or for a node to handle a frame. Then the replay ends, because it is
  // no longer lossless.
  std::chrono::milliseconds timeout{5000};
};

// Sets the plan's time range, given in seconds after the recording's start. Throws UsageError if
// the range contains no messages.
void set_range(ReplayPlan& plan, const recording::Recording& recording, double start_s,
               std::optional<double> end_s);

}  // namespace fivepipe::replay
