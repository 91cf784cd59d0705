// Options that several subcommands share.
#pragma once
#include <CLI/CLI.hpp>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace fivepipe::launch {

// --set KEY=VALUE, repeatable. The parser rejects texts without a key.
CLI::Option* add_set_option(CLI::App* app, std::vector<std::string>& assignments);
// Splits the assignments at their first '='. The last assignment of a key takes effect.
std::map<std::string, std::string> settings_from(const std::vector<std::string>& assignments);

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

// --domain and --profile of a command that joins the network without a deployment.
struct NetworkOptions {
  std::uint32_t domain = 0;
  std::string profile = "loopback";
};
void add_network_options(CLI::App* app, NetworkOptions& options);

}  // namespace fivepipe::launch
