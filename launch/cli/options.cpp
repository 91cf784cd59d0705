#include "launch/cli/options.h"

#include <stdexcept>

#include "common/base/readable_file.h"
#include "common/base/regex.h"
#include "common/pipeline/node/deployment_network.h"
#include "launch/supervise/own_files.h"

namespace fivepipe::launch {
namespace {

std::string check_assignment(const std::string& text) {
  const std::size_t equals = text.find('=');
  return equals == std::string::npos || equals == 0 ? "expected KEY=VALUE, got '" + text + "'" : "";
}

std::string check_rate(const std::string& text) {
  if (text == "max") return "";
  try {
    std::size_t end = 0;
    if (const double rate = std::stod(text, &end); end == text.size() && rate > 0 && rate <= 1000)
      return "";
  } catch (const std::logic_error&) {
  }
  return "expected max or a number greater than 0 and at most 1000, got '" + text + "'";
}

std::string check_regex(const std::string& text) {
  try {
    const base::Regex parsed(text);
  } catch (const base::RegexError& error) {
    return "'" + text + "' is not a regular expression: " + error.what();
  }
  return "";
}

// The others need a deployment.
std::vector<std::string> local_profiles() {
  std::vector<std::string> names = bus::profile_names();
  std::erase_if(names, bus::reaches_other_machines);
  return names;
}

}  // namespace

CLI::Validator existing_file() {
  return {[](const std::string& file) {
            // What else is wrong with it is found by reading it.
            const bool is_file =
                std::filesystem::exists(file) && !std::filesystem::is_directory(file);
            return is_file ? "" : file + ": " + base::why_unreadable(file).value_or("");
          },
          "FILE"};
}

CLI::Option* add_rate_option(CLI::App* app, std::string& rate) {
  return app->add_option("--rate", rate, "speed: 1 as recorded, 0.5 half as fast, max unthrottled")
      ->check(CLI::Validator(check_rate, "R|max"))
      ->capture_default_str();
}
double rate_from(const std::string& rate) { return rate == "max" ? 0 : std::stod(rate); }

CLI::Option* add_topics_option(CLI::App* app, std::string& topics) {
  return app
      ->add_option(
          "--topics", topics,
          "select the topics whose name contains a match of this regular expression; letter case "
          "matters")
      ->check(CLI::Validator(check_regex, "RE"))
      ->capture_default_str();
}

RangeOptions add_range_options(CLI::App* app, double& start_s, std::optional<double>& end_s) {
  // Three years. A stamp of today plus this duration in nanoseconds fits into 64 bits.
  constexpr double kMaxRecording_s = 1e8;
  const auto in_recording = CLI::Range(0.0, kMaxRecording_s);
  return {app->add_option("--start", start_s,
                          "begin at this time in seconds since the recording's start")
              ->check(in_recording),
          app->add_option("--end", end_s, "end at this time in seconds since the recording's start")
              ->check(in_recording)};
}

CLI::Option* add_set_option(CLI::App* app, std::vector<std::string>& assignments) {
  return app
      ->add_option("--set", assignments, "KEY=VALUE replaces ${KEY} in the deployment; repeatable")
      ->allow_extra_args(false)
      ->check(CLI::Validator(check_assignment, "KEY=VALUE"));
}

std::map<std::string, std::string> settings_from(const std::vector<std::string>& assignments) {
  std::map<std::string, std::string> settings;
  for (const std::string& assignment : assignments) {
    const std::size_t equals = assignment.find('=');
    settings[assignment.substr(0, equals)] = assignment.substr(equals + 1);
  }
  return settings;
}

CLI::Option* add_domain_option(CLI::App* app, std::uint32_t& domain) {
  return app->add_option("--domain", domain, "DDS domain")
      ->check(CLI::Range(0, config::kMaxDomain))
      ->capture_default_str();
}

void add_network_options(CLI::App* app, NetworkOptions& options) {
  options.domain_option = add_domain_option(app, options.domain);
  app->add_option("--profile", options.profile, "network profile")
      ->check(CLI::IsMember(local_profiles()))
      ->capture_default_str();
}

void add_host_options(CLI::App* app, NetworkOptions& options) {
  CLI::Option* const deployment = app->get_option("--deployment");
  CLI::Option* const host = app->add_option("--host", options.host,
                                            "name of this machine in the deployment (default: the "
                                            "host with its name or one of its addresses)");
  host->needs(deployment);
  app->add_flag("--local", options.local,
                "use the loopback interface instead of the deployment's network")
      ->needs(deployment)
      ->excludes(host);
}

void add_deployment_options(CLI::App* app, NetworkOptions& options) {
  app->add_option("--deployment", options.deployment,
                  "join the network of this deployment (file, or name of a shipped one): its "
                  "domain, profile and hosts. Its nodes accept only messages that are sent with it")
      ->excludes(app->get_option("--profile"));
  if (!app->get_option_no_throw("--set")) add_set_option(app, options.settings);
  add_host_options(app, options);
}

std::string other_domain_or(const std::string& why, const NetworkOptions& options) {
  if (!why.empty()) return "; " + why;
  return std::string("; --domain selects another one") +
         (options.deployment.empty() ? ", and a deployment on several hosts needs --deployment FILE"
                                     : "");
}

config::Deployment deployment_of(const NetworkOptions& options) {
  return config::load_deployment(deployment_file(options.deployment),
                                 settings_from(options.settings));
}

std::uint32_t domain_of(const NetworkOptions& options, const config::Deployment& deployment) {
  const bool has_domain = options.domain_option && options.domain_option->count() > 0;
  return has_domain ? options.domain : deployment.domain;
}

JoinedNetwork network_from(const NetworkOptions& options, security::Role role) {
  if (options.deployment.empty()) return {options.domain, options.profile, ""};
  const config::Deployment deployment = deployment_of(options);
  const std::uint32_t domain = domain_of(options, deployment);
  JoinedNetwork joined{domain,
                       node::network_of(deployment, {role, domain, options.host, options.local}),
                       deployment.name};
  const bool has_hosts = !options.local && deployment.hosts.size() > 1;
  for (const config::Node& node : deployment.nodes)
    joined.nodes[node.name] = has_hosts ? node.host : "";
  return joined;
}

}  // namespace fivepipe::launch
