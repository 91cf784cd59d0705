#include <unistd.h>

#include <chrono>
#include <iostream>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "common/base/output_queue.h"
#include "common/base/timing.h"
#include "launch/cli/commands.h"
#include "launch/cli/options.h"
#include "launch/supervise/hosts/host_exchange.h"
#include "launch/supervise/interrupt.h"
#include "launch/supervise/status/live_status.h"
#include "launch/supervise/status/status_messages.h"

namespace fivepipe::launch {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kRefreshPeriod = 1s;
// Discovery takes up to 1 s, and nodes publish twice per second.
constexpr auto kListeningTime = 2500ms;

struct TopOptions {
  NetworkOptions network;
  bool once = false;
};

// The state of each host, and when it arrived.
using HostStates = std::map<std::string, std::pair<HostState, Clock::time_point>>;

void take_hosts(bus::Reader<bus::topics::HostStatus>& reader, HostStates& hosts) {
  for (const auto& sample : reader.take())
    if (HostState state = sample.valid() ? state_from(*sample) : HostState{};
        state.speaker.program == "up" &&
        (hosts.size() < kMaxListed || hosts.contains(state.speaker.host)))
      hosts[state.speaker.host] = {state, Clock::now()};
}

std::vector<HeardHost> heard(const HostStates& hosts) {
  std::vector<HeardHost> heard;
  for (const auto& [host, state] : hosts)
    heard.push_back({state.first, base::seconds_since(state.second)});
  return heard;
}

// Those with nodes of a deployment on several hosts.
std::set<std::string> deployed_hosts(const JoinedNetwork& joined) {
  std::set<std::string> hosts;
  for (const auto& [node, host] : joined.nodes)
    if (!host.empty()) hosts.insert(host);
  return hosts;
}

int run_top(const TopOptions& options) {
  ignore_closed_pipes();
  const JoinedNetwork joined = network_from(options.network, security::Role::observer);
  bus::Bus bus(
      {.domain = joined.domain, .network = joined.network, .deployment = joined.deployment});
  auto statuses_in = bus.reader<bus::topics::NodeStatus>();
  auto metrics_in = bus.reader<bus::topics::SimulationMetrics>();
  auto hosts_in = bus.reader<bus::topics::HostStatus>();
  HostStates hosts;
  StatusRegistry registry;
  SimulationRegistry simulations;
  const bool on_terminal = isatty(STDOUT_FILENO) && !options.once;
  const auto listening_time = kListeningTime + bus::authentication_time(joined.network);
  for (auto next = Clock::now() + (options.once ? Clock::duration(listening_time)
                                                : Clock::duration(kRefreshPeriod));
       ; next += kRefreshPeriod) {
    while (Clock::now() < next) {
      if (!bus.wait(std::chrono::ceil<std::chrono::milliseconds>(next - Clock::now()))) continue;
      take_statuses(statuses_in, registry);
      take_metrics(metrics_in, simulations);
      take_hosts(hosts_in, hosts);
    }
    const bool is_silent = registry.processes().empty();
    if (on_terminal) std::cout << "\x1b[H\x1b[2J";  // cursor to the top left corner, clear
    if (is_silent)
      std::cout << "no node publishes a status in domain " << joined.domain
                << other_domain_or(bus.why_not_admitted(), options.network) << '\n';
    if (!is_silent || !joined.nodes.empty())
      std::cout << nodes_table(registry, arrival_clock_ns(), joined.nodes)
                << node_messages(registry)
                << simulations_table(simulations, registry, arrival_clock_ns())
                << hosts_table(heard(hosts), deployed_hosts(joined)) << (on_terminal ? "" : "\n");
    std::cout << std::flush;
    if (options.once) return is_silent ? 3 : 0;
    if (!std::cout) return base::is_broken_pipe(STDOUT_FILENO) ? 0 : 1;
  }
}

}  // namespace

void add_top(CLI::App& app, Command& command) {
  auto options = std::make_shared<TopOptions>();
  CLI::App* top = app.add_subcommand(
      "top", "Show the running nodes and refresh the table each second until Ctrl-C");
  top->footer(
      "The second table has a line per simulation for its bodies, cloths and particles, if the\n"
      "scene has any: kinetic and potential energy (0 at z = 0), contacts with the hull and "
      "between\n"
      "objects, the deepest penetration at the end of the newest frame and of all frames since "
      "the\n"
      "start of `top`, and as resets the objects respawned, cloths reset, and particles removed\n"
      "because they were stuck in the hull or not finite.\n"
      "The third table has a line per host of a deployment on several: version, clock against\n"
      "that of the first host, and whether the files are the same.\n"
      "With --deployment, the tables also list its nodes without a status and its hosts that are\n"
      "missing, because `fivepipe up` does not run there or they are out of reach.\n\n"
      "Examples:\n  fivepipe top\n  fivepipe top --domain 7 --once\n"
      "  fivepipe top --deployment launch/deployments/two_hosts.yaml\n\n"
      "Exit codes with --once: 0 done, 3 no node publishes a status.");
  add_network_options(top, options->network);
  add_deployment_options(top, options->network);
  top->add_flag("--once", options->once, "print one table and end");
  top->callback([options, &command] { command = [options] { return run_top(*options); }; });
}

}  // namespace fivepipe::launch
