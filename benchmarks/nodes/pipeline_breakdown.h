// Splits the time from a frame's first message to its composite into stages. Pure.
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

// Times in ms, one per frame.
struct PipelineBreakdown {
  // The consecutive stages of the critical path. It passes through the reconstruction node whose
  // tiles were written last.
  std::vector<std::pair<std::string, std::vector<double>>> stages;
  std::vector<double> latency;  // from the first message sent to the timestamp of FrameComposited
  // From the first message sent until the benchmark received FrameComposited, measured
  // independently of the nodes.
  std::vector<double> received;
  // In parallel to the path: from the simulation's last input until its state was written.
  std::vector<double> simulation;
  std::size_t waited_for_state = 0;  // frames whose tiles arrived before the simulation's state
  double stages_mean_ms() const;
  // The fraction of the mean of `received` that the stages explain; the rest is the transport of
  // FrameComposited. 0 if nothing was received.
  double explained_fraction() const;
  void add(const PipelineBreakdown& other);  // appends the times of another run
};
PipelineBreakdown breakdown_of(const std::vector<replay::FrameTimes>& frames,
                               const PipelineNodes& nodes);

}  // namespace fivepipe::node_bench
