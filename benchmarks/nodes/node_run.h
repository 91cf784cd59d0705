// Nodes of a recorded deployment, alone with a recording: started, fed losslessly, measured.
#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/config/deployment.h"
#include "common/recording/files/recording.h"
#include "common/recording/replay/replayer.h"

namespace fivepipe::node_bench {

struct NodeRunOptions {
  const config::Deployment* deployment = nullptr;
  std::filesystem::path file;                   // of the deployment
  std::map<std::string, std::string> settings;  // of the deployment
  std::vector<std::string> nodes;  // these are started; the recording stands for all others
  double rate = 0;                 // 0: as fast as it goes
  int frames_in_flight = 2;
  replay::SendOrder order = replay::SendOrder::pipelined;
  double start_s = 0;  // from the recording's start
  std::optional<double> end_s;
  bool checksums = true;      // of what the nodes write; they are read for it
  std::filesystem::path out;  // for what nodes write and say
};

// Of all messages of a topic, whatever their order.
struct OutputDigest {
  std::uint64_t messages = 0, bytes = 0, checksum = 0;
};
struct ProcessUse {
  double cpu_s = 0,
         peak_memory_mb = 0;  // user and system during the replay; resident since the start
};

struct NodeRun {
  std::vector<replay::FrameTimes> frames;  // those that every node handled, in order
  replay::ReplayCounts counts;
  std::map<std::string, std::map<std::string, std::uint64_t>> drops;  // by node, reason
  std::map<std::string, ProcessUse> use;                              // by node
  double replay_cpu_s = 0;  // of this process: it takes its part of the cores, too
  std::map<std::string, OutputDigest> outputs;  // by topic; without what tells of times
  std::string gl_renderer;                      // as the nodes say; empty: none
};

// What a node dropped of its inputs. A video frame that its file has no time for is none.
std::uint64_t dropped_by(const NodeRun& run, const std::string& node);
// Every frame was handled, one at least, and nothing dropped: its times may be compared. Says what
// is not, on stderr.
bool is_valid_run(const NodeRun& run);

// Throws std::runtime_error with a node's last words where one does not start, or ends.
NodeRun run_nodes(const recording::Recording& recording, const NodeRunOptions& options);

}  // namespace fivepipe::node_bench
