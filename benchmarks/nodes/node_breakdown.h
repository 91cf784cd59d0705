// Where a node's time from frame to frame goes, while a replay feeds it. Pure.
#pragma once
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "common/recording/replay/frame_times.h"

namespace fivepipe::node_bench {

// By frame, but for the first [ms].
struct NodeBreakdown {
  std::vector<std::pair<std::string, std::vector<double>>>
      steps;                   // in the order in which the node takes them
  std::vector<double> own;     // since it took the frame's last input, or was done with the frame
                               // before: decoding inputs, and all steps
  std::vector<double> period;  // from one handled frame to the next
  std::vector<double>
      transport;  // of the period: the node was free, and what sets off its work on its way to it
  std::vector<double> latency;  // from the first message sent to handled
  // Of the mean period: the node's own time, and with transport. The rest: it was free, and nothing
  // had been sent.
  double own_fraction() const;
  double explained_fraction() const;
};
NodeBreakdown breakdown_of(const std::vector<replay::FrameTimes>& frames, const std::string& node);

}  // namespace fivepipe::node_bench
