#include "benchmarks/nodes/from_recording.h"

#include <fmt/format.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "common/base/result_file.h"

namespace fivepipe::node_bench {

using nlohmann::ordered_json;

MeasuredDeployment::MeasuredDeployment(const recording::Recording* recording,
                                       const FromRecordingOptions& options)
    : settings_(options.settings) {
  if (options.deployment.empty()) {
    recorded_.emplace(*recording, settings_);
    settings_ = recorded_->settings();
  } else {
    own_ = config::load_deployment(options.deployment, settings_);
  }
  if (options.out.empty())
    temporary_out_ =
        std::filesystem::temp_directory_path() / fmt::format("fivepipe-bench-{}", getpid());
}

MeasuredDeployment::~MeasuredDeployment() {
  std::error_code ignored;  // a folder that remains in /tmp is no reason to fail
  if (!temporary_out_.empty()) std::filesystem::remove_all(temporary_out_, ignored);
}

NodeRunOptions MeasuredDeployment::run_options(const FromRecordingOptions& options) const {
  NodeRunOptions run;
  run.deployment = &deployment();
  run.file = recorded_ ? recorded_->file() : options.deployment;
  run.settings = settings_;
  run.rate = options.rate;
  run.frames_in_flight = options.frames_in_flight;
  run.start_s = options.start_s;
  run.end_s = options.end_s;
  run.out = options.out.empty() ? temporary_out_ : options.out;
  std::filesystem::create_directories(run.out);
  return run;
}

std::string checksum_text(std::uint64_t checksum) { return fmt::format("{:016x}", checksum); }

ordered_json result_json(const std::string& name, const std::vector<double>& time_ms,
                         const ordered_json& counts, const std::string& checksum) {
  return {{"name", name},
          {"time_ms", base::times_json(time_ms)},
          {"error", ordered_json::object()},
          {"counts", counts},
          {"checksum", checksum}};
}

ordered_json result_json(const std::string& name, const std::vector<double>& time_ms) {
  return result_json(name, time_ms, ordered_json::object());
}

}  // namespace fivepipe::node_bench
