// Runs a node: parses the command line, loads the configuration, handles signals, opens the bus and
// the status, and converts errors to exit codes.
#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <string>

#include "common/config/deployment.h"
#include "common/pipeline/bus/bus.h"
#include "common/pipeline/node/capture_clock.h"
#include "common/pipeline/node/status.h"

namespace fivepipe::node {

// A failure with its own exit code, such as 3: hardware or peer missing.
struct NodeFailure : std::runtime_error {
  NodeFailure(int code, const std::string& what) : std::runtime_error(what), exit_code(code) {}
  int exit_code;
};

struct NodeContext {
  const config::Deployment& deployment;
  const config::Node& node;
  std::filesystem::path out;  // folder for files; empty: the node writes none
  bool every_frame;           // --every-frame
  bus::Bus& bus;
  NodeStatusReporter& status;
  // As capture_clock_of() returns it.
  const CaptureClock* capture_clock = nullptr;
  std::map<std::string, double> spacings_m = {};  // --spacing, by object; not checked
};

// Returns false after SIGTERM, SIGINT or stop_running(). Loops must test it at least every
// kMaxWait.
bool running();
// Ends the loop from inside the node, for example at the end of the footage.
void stop_running();
inline constexpr std::chrono::milliseconds kMaxWait{100};

// Parses the command line (arguments.h), loads the deployment, opens the bus and calls run. Exit
// codes: 0 done, 1 failed, 2 usage, configuration or keys that expire, 3 hardware or peer missing.
// The named node must be a `program`.
int run_node(const std::string& program, int argc, char** argv,
             const std::function<void(NodeContext&)>& run);

// Returns the node's settings. `Config` must be the type that belongs to the node's program.
template <class Config>
const Config& config_of(const NodeContext& context) {
  return std::get<Config>(context.node.config);
}

}  // namespace fivepipe::node
