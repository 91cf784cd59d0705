// Configuration files for tests, in a temporary folder that the fixture removes.
#pragma once
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <tuple>
#include <vector>

#include "common/config/read_files.h"
#include "tests/support/test_folder.h"

namespace fivepipe::test {

// Reads one rig or scene file. Throws ConfigError that lists every problem of the file.
inline config::Rig load_rig(const std::filesystem::path& file) {
  config::Problems problems;
  config::Rig rig = config::read_rig(file, problems);
  problems.throw_if_any();
  return rig;
}
inline config::Scene load_scene(const std::filesystem::path& file) {
  config::Problems problems;
  config::Scene scene = config::read_scene(file, problems);
  problems.throw_if_any();
  return scene;
}

class SceneFiles : public ::testing::Test {
 protected:
  // Writes a file and returns its path. Drops the line break with which a raw string R"( begins.
  std::filesystem::path write(const std::string& name, std::string text) {
    if (text.starts_with('\n')) text.erase(0, 1);
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  const std::filesystem::path& folder() const { return folder_; }

  // The problems of the ConfigError that `load` throws, each as "name:line:column: what" with the
  // file name alone. Empty if it throws none.
  template <typename Load>
  static std::vector<std::string> problems_of(Load load) {
    try {
      load();
    } catch (const config::ConfigError& error) {
      std::vector<std::string> problems;
      for (const config::ConfigProblem& p : error.problems())
        problems.push_back(std::filesystem::path(p.file).filename().string() + ':' +
                           std::to_string(p.line) + ':' + std::to_string(p.column) + ": " + p.what);
      return problems;
    }
    return {};
  }

 private:
  const test::TestFolder test_folder_;
  const std::filesystem::path folder_ = test_folder_.path;
};

// True if one of the problems contains `part`.
inline bool contains(const std::vector<std::string>& problems, const std::string& part) {
  for (const std::string& problem : problems)
    if (problem.find(part) != std::string::npos) return true;
  return false;
}

inline const std::string kGoodRig = R"(
name: two
volume_m: {min: [-0.5, -0.5, 0], max: [0.5, 0.5, 1]}
cameras:
  - name: left
    image_size_px: [320, 240]
    horizontal_fov_deg: 60
    look_at: {eye_m: [-2, 0, 1], target_m: [0, 0, 0.5]}
  - name: right
    image_size_px: [320, 240]
    fx_px: 300
    fy_px: 301
    cx_px: 160
    cy_px: 121
    look_at: {eye_m: [2, 0, 1], target_m: [0, 0, 0.5]}
)";

inline const std::string kGoodScene = R"(
name: block
objects:
  - name: block
    box: {size_m: [0.1, 0.2, 0.3]}
    position_m: [0, 0, 0.15]
)";

inline const std::string kGoodDeployment = R"(
name: small
rig: rig.yaml
scene: scene.yaml
viewer:
  path:
    - {t_s: 0, eye_m: [0, -1, 0.5], target_m: [0, 0, 0.2]}
nodes:
  - name: capture
    program: capture_node
    sources: synthetic
  - name: recon
    program: recon_node
)";

}  // namespace fivepipe::test
