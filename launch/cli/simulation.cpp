#include <chrono>
#include <iostream>
#include <map>

#include "common/pipeline/bus/bus.h"
#include "launch/cli/commands.h"
#include "launch/cli/options.h"

namespace fivepipe::launch {
namespace {

using namespace std::chrono_literals;

// Processes announce themselves once per second, so discovery takes up to 1 s.
constexpr auto kSimulationTimeout = 3s, kDeliveryTimeout = 1s;

const std::map<std::string, fivepipe_v1_CommandKind> kCommandKinds = {
    {"pause", fivepipe_v1_pause_simulation},
    {"resume", fivepipe_v1_resume_simulation},
    {"reset", fivepipe_v1_reset_simulation}};

struct SimulationOptions {
  std::string what, node;
  NetworkOptions network;
};

// Returns the deployment of the nodes that read commands, if all of them refuse those of `own`.
// Readers without a deployment are no nodes: `fivepipe echo`, for example.
std::string deployment_that_refuses(bus::Bus& bus, const std::string& own) {
  std::string other;
  for (const bus::EndpointDescription& endpoint : bus.endpoints()) {
    if (endpoint.own || endpoint.writes || endpoint.topic != bus::topics::Command::name) continue;
    if (!own.empty() && endpoint.deployment == own) return "";
    if (!endpoint.deployment.empty()) other = endpoint.deployment;
  }
  return other;
}

int run_simulation(const SimulationOptions& options) {
  const JoinedNetwork joined = network_from(options.network, security::Role::commands);
  bus::Bus bus(
      {.domain = joined.domain, .network = joined.network, .deployment = joined.deployment});
  auto commands = bus.writer<bus::topics::Command>();
  const auto deadline = std::chrono::steady_clock::now() + kSimulationTimeout +
                        bus::authentication_time(joined.network);
  while (commands.readers() == 0) {
    if (std::chrono::steady_clock::now() > deadline) {
      const std::string why = bus.why_not_admitted();
      std::cerr << "no sim_node listens in domain " << joined.domain
                << other_domain_or(why, options.network)
                << (why.empty() ? "; `fivepipe top --domain " + std::to_string(joined.domain) +
                                      "` lists the running nodes\n"
                                : "\n");
      return 3;
    }
    bus.wait(20ms);
  }
  if (const std::string other = deployment_that_refuses(bus, joined.deployment); !other.empty()) {
    std::cerr << "the sim_node in domain " << joined.domain << " belongs to deployment '" << other
              << "' and accepts only its commands: add --deployment and its file\n";
    return 3;
  }
  fivepipe_v1_Command command{};
  if (options.node.size() >= sizeof command.target) {
    std::cerr << "--node: a node's name has at most " << sizeof command.target - 1
              << " characters\n";
    return 2;
  }
  options.node.copy(command.target, options.node.size());
  command.kind = kCommandKinds.at(options.what);
  commands.write(command);
  return commands.wait_for_delivery(kDeliveryTimeout) ? 0 : 1;
}

}  // namespace

void add_simulation(CLI::App& app, Command& command) {
  auto options = std::make_shared<SimulationOptions>();
  CLI::App* simulation =
      app.add_subcommand("simulation", "Pause, resume or reset the running simulation");
  simulation->footer(
      "Examples:\n"
      "  fivepipe simulation pause --deployment demo\n"
      "  fivepipe simulation reset --deployment demo --node simulation --domain 7\n\n"
      "Exit codes: 0 delivered, 1 not delivered, 2 usage, 3 no sim_node listens, or all of them "
      "belong "
      "to another deployment.");
  simulation
      ->add_option("COMMAND", options->what,
                   "pause, resume, or reset (moves every object to its start)")
      ->required()
      ->check(CLI::Validator(
          [](const std::string& text) {
            return kCommandKinds.contains(text) ? std::string()
                                                : "'" + text + "' is not pause, resume or reset";
          },
          "{pause,reset,resume}"));
  simulation->add_option("--node", options->node,
                         "node to send the command to (default: every sim_node)");
  add_network_options(simulation, options->network);
  add_deployment_options(simulation, options->network);
  simulation->callback(
      [options, &command] { command = [options] { return run_simulation(*options); }; });
}

}  // namespace fivepipe::launch
