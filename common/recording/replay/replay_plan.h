// What a replay sends, to whom, and how fast.
#pragma once
#include <chrono>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/recording/files/recording.h"

namespace fivepipe::replay {

// Somebody whose inputs are replayed.
struct ReplayedNode {
  std::string name, program;
};

// How a frame's messages are sent to nodes that are waited for.
enum class SendOrder {
  inputs_first,  // what a frame needs has arrived before what sets off work on it: the same output
                 // on every run
  pipelined,     // and, as fast as it goes, is sent while the nodes still work on the frame before
  as_captured,   // one after the other without waiting, as capture_node does
};

struct ReplayPlan {
  std::set<mcap::Id> channels;  // of the recording
  std::int64_t start_ns = 0,
               end_ns =
                   0;  // log stamps, both included; what is latched before the start is sent first
  double rate = 1;     // 1: as recorded; 0: as fast as it goes
  // Writers block until their readers have everything, and each frame's messages go out together,
  // in the order in which they are needed.
  bool lossless = false;
  // Lossless: at most so many frames are with these nodes at a time. A frame has left a node when
  // its FrameTrace says so.
  std::vector<ReplayedNode> nodes;
  int frames_in_flight = 2;
  SendOrder order = SendOrder::inputs_first;
  std::size_t shape_cameras = 0;  // maps that make a frame set, of nodes that wait for sets
  std::chrono::milliseconds timeout{
      5000};  // for a reader, or for a node to handle a frame; then it ends: it is lossless no more
};

// Sets the plan's start and end, given in seconds after the recording's start. Throws UsageError
// where nothing is recorded between them.
void set_range(ReplayPlan& plan, const recording::Recording& recording, double start_s,
               std::optional<double> end_s);

}  // namespace fivepipe::replay
