#include "launch/options.h"

#include "common/bus/profile.h"

namespace fivepipe {
namespace {

std::string check_assignment(const std::string& text) {
  const std::size_t equals = text.find('=');
  return equals == std::string::npos || equals == 0 ? "expected KEY=VALUE, got '" + text + "'" : "";
}

}  // namespace

CLI::Option* add_set_option(CLI::App* app, std::vector<std::string>& assignments) {
  return app->add_option("--set", assignments, "KEY=VALUE for ${KEY} in the deployment; may be given several times")
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

void add_network_options(CLI::App* app, NetworkOptions& options) {
  app->add_option("--domain", options.domain, "DDS domain")->check(CLI::Range(0, 230))->capture_default_str();
  app->add_option("--profile", options.profile, "network profile")->check(CLI::IsMember(profile_names()))->capture_default_str();
}

}  // namespace fivepipe
