// Options that several subcommands have.
#pragma once
#include <CLI/CLI.hpp>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace fivepipe::launch {

// --set KEY=VALUE, any number of times.
CLI::Option* add_set_option(CLI::App* app, std::vector<std::string>& assignments);
std::map<std::string, std::string> settings_from(const std::vector<std::string>& assignments);

// --rate R|max.
CLI::Option* add_rate_option(CLI::App* app, std::string& rate);
double rate_from(const std::string& rate);  // max: 0

// --topics RE.
CLI::Option* add_topics_option(CLI::App* app, std::string& topics);

// --start and --end, in seconds after a recording's start.
struct RangeOptions {
  CLI::Option *start, *end;
};
RangeOptions add_range_options(CLI::App* app, double& start_s, std::optional<double>& end_s);

// --domain and --profile, of who joins a network without a deployment.
struct NetworkOptions {
  std::uint32_t domain = 0;
  std::string profile = "loopback";
};
void add_network_options(CLI::App* app, NetworkOptions& options);

}  // namespace fivepipe::launch
