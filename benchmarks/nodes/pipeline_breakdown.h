// Where the time between the first message of a frame and its composite goes, process by process.
// Pure.
#pragma once
#include <string>
#include <utility>
#include <vector>

#include "common/recording/replay/frame_times.h"

namespace fivepipe::node_bench {

struct PipelineNodes {
  std::vector<std::string> reconstruction;
  std::string simulation, rendering;
};

// By frame [ms].
struct PipelineBreakdown {
  // One after the other, on the way that took longest: of the reconstruction nodes, the one whose
  // tiles came last.
  std::vector<std::pair<std::string, std::vector<double>>> stages;
  std::vector<double> latency;  // from the first message sent to the time stamp of FrameComposited
  std::vector<double>
      received;  // measured apart from what nodes tell: until FrameComposited was here
  std::vector<double>
      simulation;  // beside it: from the simulation's last input to its state written
  std::size_t waited_for_state = 0;  // frames whose tiles were there before the simulation's state
  double stages_mean_ms() const;
  // How much of what was measured the stages add up to; 0 where nothing was received. Missing is
  // the way back of FrameComposited.
  double explained_fraction() const;
  void add(const PipelineBreakdown& other);  // of another run
};
PipelineBreakdown breakdown_of(const std::vector<replay::FrameTimes>& frames,
                               const PipelineNodes& nodes);

}  // namespace fivepipe::node_bench
