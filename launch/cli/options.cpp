#include "launch/cli/options.h"

#include <regex>
#include <stdexcept>

#include "common/pipeline/bus/profile.h"

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
  return "expected max, or a number above 0, at most 1000; got '" + text + "'";
}

std::string check_regex(const std::string& text) {
  try {
    const std::regex parsed(text);
  } catch (const std::regex_error& error) {
    return "'" + text + "' is no regular expression: " + error.what();
  }
  return "";
}

}  // namespace

CLI::Option* add_rate_option(CLI::App* app, std::string& rate) {
  return app
      ->add_option("--rate", rate, "1: as recorded, 0.5: half as fast, max: as fast as it goes")
      ->check(CLI::Validator(check_rate, "R|max"))
      ->capture_default_str();
}
double rate_from(const std::string& rate) { return rate == "max" ? 0 : std::stod(rate); }

CLI::Option* add_topics_option(CLI::App* app, std::string& topics) {
  return app
      ->add_option("--topics", topics, "only topics whose name matches this regular expression")
      ->check(CLI::Validator(check_regex, "RE"))
      ->capture_default_str();
}

RangeOptions add_range_options(CLI::App* app, double& start_s, std::optional<double>& end_s) {
  constexpr double kLongestRecording_s =
      1e8;  // three years: its nanoseconds fit into 64 bits beside a stamp
  const auto in_recording = CLI::Range(0.0, kLongestRecording_s);
  return {
      app->add_option("--start", start_s, "seconds after the recording's start")
          ->check(in_recording),
      app->add_option("--end", end_s, "seconds after the recording's start")->check(in_recording)};
}

CLI::Option* add_set_option(CLI::App* app, std::vector<std::string>& assignments) {
  return app
      ->add_option("--set", assignments,
                   "KEY=VALUE for ${KEY} in the deployment; may be given several times")
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
  app->add_option("--domain", options.domain, "DDS domain")
      ->check(CLI::Range(0, 230))
      ->capture_default_str();
  app->add_option("--profile", options.profile, "network profile")
      ->check(CLI::IsMember(bus::profile_names()))
      ->capture_default_str();
}

}  // namespace fivepipe::launch
