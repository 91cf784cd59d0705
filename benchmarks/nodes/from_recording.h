// What the benchmarks from a recording share: their options, the deployment that they measure, and
// an entry of their result file.
#pragma once
#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "benchmarks/nodes/node_run.h"
#include "common/recording/replay/recorded_deployment.h"

namespace fivepipe::node_bench {

struct FromRecordingOptions {
  std::filesystem::path recording;
  std::filesystem::path deployment;             // empty: the recorded one
  std::map<std::string, std::string> settings;  // of the deployment
  double rate = 0;                              // of the replay; 0: unthrottled
  int frames_in_flight = 2, runs = 1;
  double start_s = 0;  // after the recording's start
  std::optional<double> end_s;
  std::filesystem::path json;  // the result file; empty: none
  std::filesystem::path out;   // the folder for the nodes' output; empty: a temporary one
};

// The deployment that a benchmark measures, with its settings.
class MeasuredDeployment {
 public:
  // Throws as RecordedDeployment does if options.deployment is empty, else config::ConfigError if
  // it cannot be loaded. `recording` may be null if options.deployment is not empty.
  MeasuredDeployment(const recording::Recording* recording, const FromRecordingOptions& options);
  ~MeasuredDeployment();  // removes the temporary output folder
  MeasuredDeployment(const MeasuredDeployment&) = delete;
  MeasuredDeployment& operator=(const MeasuredDeployment&) = delete;
  // Creates the output folder. The result borrows the deployment; the caller sets the nodes.
  NodeRunOptions run_options(const FromRecordingOptions& options) const;
  const config::Deployment& deployment() const {
    return recorded_ ? recorded_->deployment() : *own_;
  }

 private:
  std::optional<replay::RecordedDeployment> recorded_;
  std::optional<config::Deployment> own_;
  std::map<std::string, std::string> settings_;
  std::filesystem::path temporary_out_;
};

// {"name", "time_ms", "error": {}, "counts", "checksum"}. `counts` is an object.
nlohmann::ordered_json result_json(const std::string& name, const std::vector<double>& time_ms,
                                   const nlohmann::ordered_json& counts,
                                   const std::string& checksum = "");
nlohmann::ordered_json result_json(const std::string& name, const std::vector<double>& time_ms);
std::string checksum_text(std::uint64_t checksum);  // 16 hexadecimal digits

}  // namespace fivepipe::node_bench
