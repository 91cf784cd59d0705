#include "common/pipeline/node/run_node.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <atomic>
#include <csignal>
#include <iostream>

#include "common/base/process/heartbeat.h"
#include "common/base/version.h"
#include "common/pipeline/node/arguments.h"
#include "common/pipeline/node/deployment_network.h"

namespace fivepipe::node {
namespace {

std::atomic<bool> is_running{true};
static_assert(std::atomic<bool>::is_always_lock_free, "set from a signal handler");

void on_signal(int) { is_running = false; }

void install_signal_handlers() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGINT, &action, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
}

int run(const std::string& program, const Arguments& args,
        const std::function<void(NodeContext&)>& body) {
  const base::BeatingThread beating;
  const config::Deployment deployment = config::load_deployment(args.deployment, args.settings);
  const config::Node* node = config::find_node(deployment, args.node);
  if (!node)
    throw config::ConfigError({{args.deployment, 0, 0, "no node named '" + args.node + "'"}});
  if (config::program_of(*node) != program)
    throw config::ConfigError(
        {{args.deployment, node->line, 0,
          "node '" + args.node + "' is a " + config::program_of(*node) + ", not a " + program}});
  const std::uint32_t domain = args.domain.value_or(deployment.domain);
  bus::Bus bus(
      {domain,
       network_of(deployment, {security::role_of_node(program), domain, args.host, args.local}),
       node->name, deployment.name});
  for (const std::string& warning : bus.warnings()) spdlog::warn("{}", warning);
  if (std::string(base::build_type()) != "Release")
    spdlog::warn("this is a {} build, which is many times slower than Release", base::build_type());
  const std::unique_ptr<CaptureClock> clock =
      capture_clock_of(deployment, args.host, args.local, bus);
  NodeStatusReporter status(bus, node->name, clock.get());
  NodeContext context{deployment, *node,  args.out,    args.every_frame,
                      bus,        status, clock.get(), args.spacings_m};
  body(context);
  return bus::keys_expired() ? 2 : 0;
}

}  // namespace

bool running() {
  base::beat_loop();
  return is_running;
}
void stop_running() { is_running = false; }

int run_node(const std::string& program, int argc, char** argv,
             const std::function<void(NodeContext&)>& body) {
  spdlog::set_default_logger(spdlog::stderr_color_mt(program));
  spdlog::set_pattern("%H:%M:%S.%e %^%l%$ %v");
  install_signal_handlers();
  try {
    return run(program, parse_arguments(program, argc, argv), body);
  } catch (const CommandLineExit& ends) {
    return ends.exit_code;
  } catch (const config::ConfigError& error) {
    std::cerr << error.what() << '\n';
    return 2;
  } catch (const NodeFailure& failure) {
    spdlog::critical("{}", failure.what());
    return failure.exit_code;
  } catch (const std::exception& error) {
    spdlog::critical("{}", error.what());
    return 1;
  }
}

}  // namespace fivepipe::node
