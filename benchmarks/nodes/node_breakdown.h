// Splits a node's time from frame to frame while a replay feeds it. Pure.
#pragma once
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "common/recording/replay/frame_times.h"

namespace fivepipe::node_bench {

// Times in ms, one per frame except the first.
struct NodeBreakdown {
  std::vector<std::pair<std::string, std::vector<double>>> steps;  // in the node's order
  // From the node's last input of the frame, or the end of the previous frame if that is later, to
  // the end of the frame: decoding of inputs, and all steps.
  std::vector<double> own;
  std::vector<double> period;  // from the end of one frame to the end of the next
  // The part of the period in which the node is idle and the message that triggers its work is on
  // the bus.
  std::vector<double> transport;
  std::vector<double> latency;  // from the first message sent to the end of the frame
  // Fractions of the mean period: the own time; the own time and the transport. In the rest the
  // node is idle and no message is on the bus.
  double own_fraction() const;
  double explained_fraction() const;
  void add(const NodeBreakdown& other);  // appends the times of another run
};
// Skips frames for which the node has no output.
NodeBreakdown breakdown_of(const std::vector<replay::FrameTimes>& frames, const std::string& node);

}  // namespace fivepipe::node_bench
