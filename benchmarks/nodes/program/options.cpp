#include "benchmarks/nodes/program/options.h"

#include "launch/cli/options.h"

namespace fivepipe::measure {

BenchOptions::BenchOptions(CLI::App& app, bool needs_recording) {
  CLI::Option* from =
      app.add_option("--from", options_.recording, "the recording (MCAP) that feeds the nodes")
          ->required(needs_recording)
          ->check(CLI::ExistingFile);
  app.add_option("--deployment", options_.deployment,
                 needs_recording ? "measure this deployment instead of the recorded one"
                                 : "measure this deployment; with --from: instead of the recorded "
                                   "one")
      ->check(CLI::ExistingFile);
  launch::add_set_option(&app, settings_);
  launch::add_rate_option(&app, rate_)->needs(from);
  app.add_option("--in-flight", options_.frames_in_flight,
                 "largest number of frames that are sent but not yet handled")
      ->check(CLI::Range(1, 6))
      ->capture_default_str()
      ->needs(from);
  app.add_option("--runs", options_.runs, "number of runs, each with new processes")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  const launch::RangeOptions range =
      launch::add_range_options(&app, options_.start_s, options_.end_s);
  range.start->needs(from);
  range.end->needs(from);
  app.add_option("--json", options_.json, "write the results to this file (JSON)");
  app.add_option("--out", options_.out,
                 "keep the nodes' output in this folder (default: delete it)");
}

node_bench::FromRecordingOptions BenchOptions::values() const {
  node_bench::FromRecordingOptions options = options_;
  options.settings = launch::settings_from(settings_);
  options.rate = launch::rate_from(rate_);
  return options;
}

std::optional<int> parse(CLI::App& app, const std::vector<std::string>& words) {
  std::vector<std::string> reversed(words.rbegin(), words.rend());  // CLI11 expects this order
  try {
    app.parse(reversed);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return std::nullopt;
}

}  // namespace fivepipe::measure
