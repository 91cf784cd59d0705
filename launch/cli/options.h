// Options that several subcommands share.
#pragma once
#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/config/deployment.h"
#include "common/pipeline/bus/profile.h"

namespace fivepipe::launch {

// --set KEY=VALUE, repeatable. The parser rejects texts without a key.
CLI::Option* add_set_option(CLI::App* app, std::vector<std::string>& assignments);
// Splits the assignments at their first '='. The last assignment of a key takes effect.
std::map<std::string, std::string> settings_from(const std::vector<std::string>& assignments);

// Checks that an argument is a file, not a folder.
CLI::Validator existing_file();

// --rate R|max.
CLI::Option* add_rate_option(CLI::App* app, std::string& rate);
double rate_from(const std::string& rate);  // 0 for max

// --topics RE.
CLI::Option* add_topics_option(CLI::App* app, std::string& topics);

// --start and --end, in seconds since the start of the recording.
struct RangeOptions {
  CLI::Option *start, *end;
};
RangeOptions add_range_options(CLI::App* app, double& start_s, std::optional<double>& end_s);

// --domain of a command that joins the network with the default profile.
CLI::Option* add_domain_option(CLI::App* app, std::uint32_t& domain);

// How a command joins the network: by --domain and --profile, or as a deployment does.
struct NetworkOptions {
  std::uint32_t domain = 0;
  std::string profile = "loopback";
  std::filesystem::path deployment;
  std::vector<std::string> settings;  // KEY=VALUE for the deployment
  std::string host;                   // name of this machine in the deployment; empty: find it
  bool local = false;                 // the loopback interface, whatever the deployment's network
  CLI::Option* domain_option = nullptr;
};
// --domain and --profile.
void add_network_options(CLI::App* app, NetworkOptions& options);
// --host and --local, for a command that has the deployment.
void add_host_options(CLI::App* app, NetworkOptions& options);
// --deployment, --set, --host and --local, for a command that only joins the network. A command
// with a --set of its own copies it to NetworkOptions::settings.
void add_deployment_options(CLI::App* app, NetworkOptions& options);

// Ends a message that a command found nothing in its domain: with `why` (Bus::why_not_admitted()),
// or, if it is empty, with the options that select another domain or network.
std::string other_domain_or(const std::string& why, const NetworkOptions& options);

struct JoinedNetwork {
  std::uint32_t domain = 0;
  bus::Network network;
  std::string deployment;  // name; empty: none
  // The nodes of the deployment, with their hosts; an empty host if all run on one machine.
  std::map<std::string, std::string> nodes = {};
};
// The deployment that `options` name, and the domain. Throws config::ConfigError.
config::Deployment deployment_of(const NetworkOptions& options);
std::uint32_t domain_of(const NetworkOptions& options, const config::Deployment& deployment);
// role: of the command in a secured deployment. Throws config::ConfigError.
JoinedNetwork network_from(const NetworkOptions& options, security::Role role);

}  // namespace fivepipe::launch
