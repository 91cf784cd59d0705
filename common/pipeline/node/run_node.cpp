#include "common/pipeline/node/run_node.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <iostream>
#include <map>
#include <optional>

#include "common/base/version.h"

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

struct Args {
  std::string deployment, node;
  std::filesystem::path out;
  std::optional<std::uint32_t> domain;
  std::map<std::string, std::string> settings;
};

// The command line requested help or the version (0), or is wrong (2). parse() has printed the
// output.
struct CommandLineExit {
  int exit_code;
};

// Throws CommandLineExit.
Args parse(const std::string& program, int argc, char** argv) {
  CLI::App app("fivepipe " + program +
               " is one process of a deployment. `fivepipe up` starts it.\n\nExample: " + program +
               " --deployment launch/deployments/demo.yaml --node NAME");
  app.set_version_flag("--version", std::string(base::version()) + " (" + base::commit() + ", " +
                                        base::build_type() + ")");
  Args args;
  std::vector<std::string> settings;
  std::uint32_t domain = 0;
  app.add_option("--deployment", args.deployment, "deployment file (YAML)")->required();
  app.add_option("--node", args.node, "name of the node in the deployment")->required();
  app.add_option("--out", args.out, "folder for the files that the node writes");
  CLI::Option* domain_option =
      app.add_option("--domain", domain, "DDS domain (default: the deployment's)")
          ->check(CLI::Range(0, config::kMaxDomain));
  app.add_option("--set", settings, "KEY=VALUE replaces ${KEY} in the deployment; repeatable")
      ->allow_extra_args(false);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    throw CommandLineExit{app.exit(error) == 0 ? 0 : 2};
  }
  if (*domain_option) args.domain = domain;
  for (const std::string& setting : settings) {
    const std::size_t equals = setting.find('=');
    if (equals == std::string::npos || equals == 0) {
      std::cerr << program << ": --set expects KEY=VALUE, got '" << setting << "'\n";
      throw CommandLineExit{2};
    }
    args.settings[setting.substr(0, equals)] = setting.substr(equals + 1);
  }
  return args;
}

int run(const std::string& program, const Args& args,
        const std::function<void(NodeContext&)>& body) {
  const config::Deployment deployment = config::load_deployment(args.deployment, args.settings);
  const config::Node* node = config::find_node(deployment, args.node);
  if (!node)
    throw config::ConfigError({{args.deployment, 0, 0, "no node named '" + args.node + "'"}});
  if (config::program_of(*node) != program)
    throw config::ConfigError(
        {{args.deployment, node->line, 0,
          "node '" + args.node + "' is a " + config::program_of(*node) + ", not a " + program}});
  bus::Bus bus({args.domain.value_or(deployment.domain), deployment.network_profile, node->name});
  for (const std::string& warning : bus.warnings()) spdlog::warn("{}", warning);
  if (std::string(base::build_type()) != "Release")
    spdlog::warn("this is a {} build, which is many times slower than Release", base::build_type());
  NodeStatusReporter status(bus, node->name);
  NodeContext context{deployment, *node, args.out, bus, status};
  body(context);
  return 0;
}

}  // namespace

bool running() { return is_running; }
void stop_running() { is_running = false; }

int run_node(const std::string& program, int argc, char** argv,
             const std::function<void(NodeContext&)>& body) {
  spdlog::set_default_logger(spdlog::stderr_color_mt(program));
  spdlog::set_pattern("%H:%M:%S.%e %^%l%$ %v");
  install_signal_handlers();
  try {
    return run(program, parse(program, argc, argv), body);
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
