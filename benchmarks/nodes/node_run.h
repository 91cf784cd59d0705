// Starts nodes of a recorded deployment, feeds them from the recording without loss, and measures
// them.
#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "benchmarks/nodes/node_processes.h"
#include "benchmarks/nodes/run_observer.h"
#include "common/recording/files/recording.h"
#include "common/recording/replay/replayer.h"

namespace fivepipe::node_bench {

// The recording replaces the nodes that are not started.
struct NodeRunOptions : NodesToStart {
  double rate = 0;  // 0: unthrottled
  int frames_in_flight = 2;
  replay::SendOrder order = replay::SendOrder::pipelined;
  double start_s = 0;  // after the recording's start
  std::optional<double> end_s;
  bool checksums = true;   // read the nodes' output and compute its checksums
  bool trace_bus = false;  // record the messages on the loopback interface
};

// Digest of all messages of a topic, independent of their order.
struct OutputDigest {
  std::uint64_t messages = 0, bytes = 0, checksum = 0;
};

struct NodeRun : RunObservations {
  replay::ReplayCounts counts;
  std::map<std::string, ProcessUse> use;  // by node, during the replay
  double replay_cpu_s = 0;  // CPU time of the replay in this process, which shares the cores
  std::map<std::string, OutputDigest> outputs;  // by topic, without topics that contain times
};

// Returns the number of inputs that a node dropped. It excludes frames that a video file dropped,
// because they are no input.
std::uint64_t dropped_by(const NodeRun& run, const std::string& node);
// Returns whether the times may be compared: every frame was handled, at least one, and no input
// was dropped. Prints to stderr what is wrong.
bool is_valid_run(const NodeRun& run);

// Throws std::runtime_error if a node does not start or ends early, with its output, and after a
// signal.
NodeRun run_nodes(const recording::Recording& recording, const NodeRunOptions& options);

}  // namespace fivepipe::node_bench
