// What benchmarks from a recording have in common: their options, the deployment, the JSON of
// times.
#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "benchmarks/nodes/node_run.h"
#include "common/recording/replay/recorded_deployment.h"

namespace fivepipe::node_bench {

struct FromRecordingOptions {
  std::filesystem::path recording, deployment, json, out;
  std::vector<std::string> settings;
  std::string rate = "max";
  int frames_in_flight = 2, runs = 1;
  double start_s = 0;
  std::optional<double> end_s;
};
void add_from_recording_options(CLI::App& app, FromRecordingOptions& options);

// Parses the words. 0: go on; otherwise the exit code, and the answer has been given.
std::optional<int> parsed(CLI::App& app, const std::vector<std::string>& words);

// The deployment that is measured: that of --deployment, else the recorded one; with its settings.
class MeasuredDeployment {
 public:
  MeasuredDeployment(const recording::Recording& recording, const FromRecordingOptions& options);
  ~MeasuredDeployment();  // removes what nodes wrote, unless --out says where to keep it
  MeasuredDeployment(const MeasuredDeployment&) = delete;
  MeasuredDeployment& operator=(const MeasuredDeployment&) = delete;
  NodeRunOptions run_options(const FromRecordingOptions& options) const;
  const config::Deployment& deployment() const {
    return recorded_ ? recorded_->deployment() : *own_;
  }

 private:
  std::optional<replay::RecordedDeployment> recorded_;
  std::optional<config::Deployment> own_;
  std::map<std::string, std::string> settings_;
  std::filesystem::path temporary_out_;  // removed at the end
};

// One entry of the results of a benchmark's JSON.
std::string result_json(const std::string& name, const std::vector<double>& time_ms,
                        const nlohmann::ordered_json& error, const nlohmann::ordered_json& counts,
                        const std::string& checksum);
std::string checksum_text(std::uint64_t checksum);

}  // namespace fivepipe::node_bench
