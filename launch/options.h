// Options that several subcommands have.
#pragma once
#include <CLI/CLI.hpp>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace fivepipe {

// --set KEY=VALUE, any number of times.
CLI::Option* add_set_option(CLI::App* app, std::vector<std::string>& assignments);
std::map<std::string, std::string> settings_from(const std::vector<std::string>& assignments);

// --domain and --profile, of who joins a network without a deployment.
struct NetworkOptions {
  std::uint32_t domain = 0;
  std::string profile = "loopback";
};
void add_network_options(CLI::App* app, NetworkOptions& options);

}  // namespace fivepipe
