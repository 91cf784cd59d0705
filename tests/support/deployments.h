// Deployments for tests with real processes.
#pragma once
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "tests/support/text.h"

namespace fivepipe::test {

inline const std::string kSmallDeployment = FIVEPIPE_SOURCE_DIR "/tests/system/deployment.yaml";
// The nodes of the small deployment.
inline const std::string kNodes[] = {"capture", "recon_a", "recon_b", "simulation", "rendering"};
// The deployment of the kept recording tests/recordings/v1.mcap.
inline const std::string kKeptDeployment = FIVEPIPE_SOURCE_DIR "/tests/recordings/deployment.yaml";

inline std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

// Writes the small deployment to `folder`, with `from` replaced by `to` and with `rig_addition` at
// the end of its rig. Returns the path of the deployment file.
inline std::string changed_deployment(const std::filesystem::path& folder, const std::string& from,
                                      const std::string& to, const std::string& rig_addition = "") {
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "rig.yaml")
      << text_of(FIVEPIPE_SOURCE_DIR "/tests/system/rig.yaml") << rig_addition;
  std::string text =
      replaced(text_of(kSmallDeployment), "../../scenes", FIVEPIPE_SOURCE_DIR "/scenes");
  std::ofstream(folder / "deployment.yaml") << replaced(text, from, to);
  return (folder / "deployment.yaml").string();
}

}  // namespace fivepipe::test
