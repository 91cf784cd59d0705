#include "launch/supervise/node_programs.h"

#include <fmt/format.h>

#include <limits>

#include "launch/supervise/own_files.h"

namespace fivepipe::launch {

std::vector<Program> programs_of(const std::vector<config::Node>& nodes,
                                 const RunSettings& settings,
                                 std::function<std::map<std::string, double>()> spacings) {
  std::vector<Program> programs;
  for (const config::Node& node : nodes) {
    Program program{node.name,
                    {program_folder() / config::program_of(node)},
                    node.cores,
                    settings.out / "log" / (node.name + ".log"),
                    config::spectator_of(node) != nullptr};
    program.argv.insert(program.argv.end(),
                        {"--deployment", settings.deployment, "--node", node.name, "--out",
                         settings.out, "--domain", std::to_string(settings.domain)});
    for (const std::string& setting : settings.settings)
      program.argv.insert(program.argv.end(), {"--set", setting});
    if (settings.local)
      program.argv.push_back("--local");
    else if (!node.host.empty())
      program.argv.insert(program.argv.end(), {"--host", node.host});
    if (settings.every_frame && config::program_of(node) == "capture_node")
      program.argv.push_back("--every-frame");
    if (config::program_of(node) == "sim_node")
      program.arguments_at_start = [spacings] {
        std::vector<std::string> arguments;
        for (const auto& [object, spacing_m] : spacings())
          arguments.insert(arguments.end(), {"--spacing", object, fmt::format("{}", spacing_m)});
        return arguments;
      };
    programs.push_back(std::move(program));
  }
  return programs;
}

std::vector<std::string> recorder_arguments(const RunSettings& settings) {
  std::vector<std::string> arguments{"-o",           settings.record,
                                     "--deployment", settings.deployment,
                                     "--domain",     std::to_string(settings.domain)};
  for (const std::string& setting : settings.settings)
    arguments.insert(arguments.end(), {"--set", setting});
  if (settings.local) arguments.push_back("--local");
  if (!settings.host.empty()) arguments.insert(arguments.end(), {"--host", settings.host});
  arguments.insert(arguments.end(), settings.record_options.begin(), settings.record_options.end());
  return arguments;
}

std::optional<WatchdogSettings> watchdog_of(const RunSettings& settings) {
  if (!settings.watchdog) return std::nullopt;
  WatchdogSettings watchdog;
  // Without a clock, a frame may take as long as it likes.
  if (settings.every_frame) watchdog.stalled_loop_s = std::numeric_limits<double>::infinity();
  return watchdog;
}

}  // namespace fivepipe::launch
