#include "common/recording/replay/recorded_deployment.h"

#include <cstdlib>

#include "common/recording/files/format.h"

namespace fivepipe::replay {
namespace {

std::filesystem::path new_folder() {
  std::string pattern =
      (std::filesystem::temp_directory_path() / "fivepipe-recorded-XXXXXX").string();
  if (!mkdtemp(pattern.data()))
    throw std::runtime_error("cannot create a folder in " +
                             std::filesystem::temp_directory_path().string());
  return pattern;
}

}  // namespace

RecordedDeployment::RecordedDeployment(const recording::Recording& recording,
                                       const std::map<std::string, std::string>& changes)
    : folder_(new_folder()) {
  try {
    const auto file = recording.extract_deployment(folder_);
    if (!file)
      throw recording::RecordingError(
          recording.file().string() +
          " contains no deployment; record with --deployment FILE or with `fivepipe up --record`");
    file_ = *file;
    settings_ = recording.metadata(recording::kSettingsMetadata);
    for (const auto& [key, value] : changes) settings_[key] = value;
    deployment_ = config::load_deployment(file_, settings_);
  } catch (...) {
    std::filesystem::remove_all(folder_);
    throw;
  }
}

RecordedDeployment::~RecordedDeployment() {
  std::error_code ignored;  // a folder left behind in the temporary directory is no failure
  std::filesystem::remove_all(folder_, ignored);
}

std::string recorded_deployment_name(const recording::Recording& recording,
                                     const std::map<std::string, std::string>& changes) {
  try {
    return RecordedDeployment(recording, changes).deployment().name;
  } catch (const recording::RecordingError&) {
    return "";
  }
}

}  // namespace fivepipe::replay
