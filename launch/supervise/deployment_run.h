// One run of a deployment on this host, from the first process to the report. `fivepipe up` calls
// it after it has read the command line.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/config/deployment.h"

namespace fivepipe::launch {

struct RunSettings {
  std::filesystem::path deployment;   // the file; the nodes read it, too
  std::vector<std::string> settings;  // KEY=VALUE for ${KEY} in the deployment
  std::filesystem::path out;          // existing folder for the report, the logs and the images
  std::uint32_t domain = 0;           // DDS domain
  double duration_s = 0;              // from the first composited frame; 0: until interrupted
  std::filesystem::path record;       // recording to write; empty: none
  std::vector<std::string> record_options;  // further arguments for `fivepipe record`
  bool every_frame = false;                 // capture_nodes process files without a clock
  std::string host;        // name of this machine in the deployment; empty: find it
  bool watchdog = true;    // kills and restarts stalled nodes
  bool any_clock = false;  // a host whose clock is wrong is no reason to end
  bool local = false;      // all hosts' nodes run on this machine, over the loopback interface
};

// Starts the nodes, supervises them until the duration is over, the input ends, a node cannot start
// or a signal arrives (interrupt.h), then writes OUT/report.json and prints a table. Returns the
// exit code of `fivepipe up`. Throws std::runtime_error if the recorder does not start or the
// report cannot be written. `nodes` are those of this host.
int run_deployment(const RunSettings& settings, const config::Deployment& deployment,
                   const std::vector<config::Node>& nodes);

}  // namespace fivepipe::launch
