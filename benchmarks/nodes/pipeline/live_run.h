// Runs all nodes of a deployment, capture_node included, and observes their frames.
#pragma once
#include <map>
#include <string>

#include "benchmarks/nodes/node_processes.h"
#include "benchmarks/nodes/run_observer.h"

namespace fivepipe::node_bench {

struct LiveRun : RunObservations {
  std::map<std::string, ProcessUse> use;  // by node, during `seconds`
  double seconds = 0;
};

// Observes `duration_s` seconds, from kWarmUp_s after the first composite on. Throws
// std::runtime_error if a node does not start or ends early, with its output, and after a signal.
LiveRun run_live(const NodesToStart& options, double duration_s);
inline constexpr double kWarmUp_s = 1;  // the first frames load shaders and pages

}  // namespace fivepipe::node_bench
