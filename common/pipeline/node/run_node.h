// The frame around every node: command line, configuration, signals, bus, status, errors to exit
// codes.
#pragma once
#include <filesystem>
#include <functional>
#include <string>

#include "common/config/deployment.h"
#include "common/pipeline/bus/bus.h"
#include "common/pipeline/node/status.h"

namespace fivepipe::node {

// A failure with an exit code of its own (3: hardware or peer missing).
struct NodeFailure : std::runtime_error {
  NodeFailure(int code, const std::string& what) : std::runtime_error(what), exit_code(code) {}
  int exit_code;
};

struct NodeContext {
  const config::Deployment& deployment;
  const config::Node& node;
  std::filesystem::path out;  // where files go; empty: none are written
  bus::Bus& bus;
  NodeStatusReporter& status;
};

// False once SIGTERM or SIGINT has come. Loops wait at most kMaxWait at a time.
bool running();
// Ends the loop from inside (end of the footage, window closed).
void stop_running();
inline constexpr std::chrono::milliseconds kMaxWait{100};

// Parses --deployment FILE --node NAME [--domain N] [--out DIR] [--set KEY=VALUE]..., loads the
// deployment, opens the bus and calls run. Exit codes: 0 done, 1 failed, 2 usage or configuration,
// 3 hardware or peer missing. `program` must be the node's.
int run_node(const std::string& program, int argc, char** argv,
             const std::function<void(NodeContext&)>& run);

// The node's own section, of the type that its program implies.
template <class Config>
const Config& config_of(const NodeContext& context) {
  return std::get<Config>(context.node.config);
}

}  // namespace fivepipe::node
