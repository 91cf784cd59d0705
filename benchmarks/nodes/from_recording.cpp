#include "benchmarks/nodes/from_recording.h"

#include <unistd.h>

#include <cstdio>

#include "common/base/result_file.h"
#include "launch/cli/options.h"

namespace fivepipe::node_bench {

void add_from_recording_options(CLI::App& app, FromRecordingOptions& options) {
  app.add_option("--from", options.recording, "recording (MCAP): the exact inputs")
      ->required()
      ->check(CLI::ExistingFile);
  app.add_option("--deployment", options.deployment,
                 "deployment to measure instead of the recorded one")
      ->check(CLI::ExistingFile);
  launch::add_set_option(&app, options.settings);
  launch::add_rate_option(&app, options.rate);
  app.add_option("--in-flight", options.frames_in_flight, "frames sent and not yet handled")
      ->check(CLI::Range(1, 6))
      ->capture_default_str();
  app.add_option("--runs", options.runs, "whole runs, each with new processes")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  launch::add_range_options(&app, options.start_s, options.end_s);
  app.add_option("--json", options.json, "write the results there");
  app.add_option("--out", options.out, "folder for what the nodes write; without it: none is kept");
}

std::optional<int> parsed(CLI::App& app, const std::vector<std::string>& words) {
  std::vector<std::string> reversed(words.rbegin(), words.rend());  // as CLI11 takes them
  try {
    app.parse(reversed);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return std::nullopt;
}

MeasuredDeployment::MeasuredDeployment(const recording::Recording& recording,
                                       const FromRecordingOptions& options)
    : settings_(launch::settings_from(options.settings)) {
  if (options.deployment.empty()) {
    recorded_.emplace(recording, settings_);
    settings_ = recorded_->settings();
  } else {
    own_ = config::load_deployment(options.deployment, settings_);
  }
  if (options.out.empty())
    temporary_out_ =
        std::filesystem::temp_directory_path() / ("fivepipe-bench-" + std::to_string(getpid()));
}

MeasuredDeployment::~MeasuredDeployment() {
  std::error_code ignored;  // a folder left in /tmp is no reason to fail
  if (!temporary_out_.empty()) std::filesystem::remove_all(temporary_out_, ignored);
}

NodeRunOptions MeasuredDeployment::run_options(const FromRecordingOptions& options) const {
  NodeRunOptions run;
  run.deployment = &deployment();
  run.file = recorded_ ? recorded_->file() : options.deployment;
  run.settings = settings_;
  run.rate = launch::rate_from(options.rate);
  run.frames_in_flight = options.frames_in_flight;
  run.start_s = options.start_s;
  run.end_s = options.end_s;
  run.out = options.out.empty() ? temporary_out_ : options.out;
  std::filesystem::create_directories(run.out);
  return run;
}

std::string checksum_text(std::uint64_t checksum) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(checksum));
  return text;
}

std::string result_json(const std::string& name, const std::vector<double>& time_ms,
                        const nlohmann::ordered_json& error, const nlohmann::ordered_json& counts,
                        const std::string& checksum) {
  return "  {\"name\": " + base::quoted(name) + ", \"time_ms\": " + base::times_json(time_ms) +
         ", \"error\": " + error.dump() + ", \"counts\": " + counts.dump() +
         ", \"checksum\": " + base::quoted(checksum) + "}";
}

}  // namespace fivepipe::node_bench
