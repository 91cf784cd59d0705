// Extracts the deployment of a recording into a temporary folder and loads it.
#pragma once
#include <filesystem>
#include <map>
#include <string>

#include "common/config/deployment.h"
#include "common/recording/files/recording.h"

namespace fivepipe::replay {

class RecordedDeployment {
 public:
  // `changes` override the recorded settings. Throws recording::RecordingError if the recording has
  // no deployment, ConfigError if it cannot be loaded.
  RecordedDeployment(const recording::Recording& recording,
                     const std::map<std::string, std::string>& changes);
  ~RecordedDeployment();  // removes the folder
  RecordedDeployment(const RecordedDeployment&) = delete;
  RecordedDeployment& operator=(const RecordedDeployment&) = delete;

  const config::Deployment& deployment() const { return deployment_; }
  const std::filesystem::path& file() const { return file_; }
  const std::map<std::string, std::string>& settings() const { return settings_; }

 private:
  std::filesystem::path folder_, file_;
  std::map<std::string, std::string> settings_;
  config::Deployment deployment_;
};

// Returns the name of the recorded deployment; empty if the recording has none. Throws ConfigError
// if it cannot be loaded.
std::string recorded_deployment_name(const recording::Recording& recording,
                                     const std::map<std::string, std::string>& changes);

}  // namespace fivepipe::replay
