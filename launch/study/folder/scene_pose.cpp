#include "launch/study/folder/scene_pose.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <optional>
#include <vector>

#include "common/base/result_file.h"
#include "common/base/usage_error.h"

namespace fivepipe::study {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> lines_of(const fs::path& file) {
  std::ifstream in(file);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::size_t indent_of(const std::string& line) { return line.find_first_not_of(' '); }

// Sets "key: value" in the entry whose first line, "- name: ...", is at `entry`.
void set_key(std::vector<std::string>& lines, std::size_t entry, const std::string& key,
             const std::string& value) {
  const std::size_t indent = indent_of(lines[entry]) + 2;
  const std::string line = std::string(indent, ' ') + key + ": " + value;
  for (std::size_t i = entry + 1; i < lines.size(); ++i) {
    const std::size_t here = indent_of(lines[i]);
    if (here == std::string::npos || lines[i][here] == '#') continue;
    if (here < indent) break;
    if (here == indent && lines[i].compare(here, key.size() + 1, key + ":") == 0) {
      lines[i] = line;
      return;
    }
  }
  lines.insert(lines.begin() + std::ptrdiff_t(entry) + 1, line);
}

std::optional<std::size_t> entry_of(const std::vector<std::string>& lines,
                                    const std::string& object) {
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::size_t indent = indent_of(lines[i]);
    if (indent != std::string::npos && lines[i].substr(indent) == "- name: " + object) return i;
  }
  return std::nullopt;
}

bool has_pose(const StudyFolder& study, const std::string& object, const Eigen::Isometry3d& pose) {
  for (const config::SceneObject& found : study.deployment().scene.objects)
    if (found.name == object) return found.world_from_object.isApprox(pose, 1e-5);
  return false;
}

}  // namespace

ScenePose scene_pose(const Eigen::Isometry3d& world_from_object) {
  const Eigen::Vector3d zyx = world_from_object.linear().eulerAngles(2, 1, 0);
  return {world_from_object.translation(),
          180 / std::numbers::pi * Eigen::Vector3d(zyx[2], zyx[1], zyx[0])};
}

std::string yaml_of(const Eigen::Vector3d& vector) {
  const auto rounded = [](double value) { return std::round(1e6 * value) / 1e6 + 0.0; };
  return fmt::format("[{}, {}, {}]", rounded(vector.x()), rounded(vector.y()), rounded(vector.z()));
}

fs::path write_pose(const StudyFolder& study, const std::string& object,
                    const Eigen::Isometry3d& world_from_object) {
  const auto [position_m, rotation_deg] = scene_pose(world_from_object);
  for (const fs::path& file : study.deployment().files) {
    if (file.extension() != ".yaml") continue;
    std::vector<std::string> lines = lines_of(file);
    const auto entry = entry_of(lines, object);
    if (!entry) continue;
    set_key(lines, *entry, "rotation_deg", yaml_of(rotation_deg));
    set_key(lines, *entry, "position_m", yaml_of(position_m));
    std::string text;
    for (const std::string& line : lines) text += line + '\n';
    const fs::path before = file.string() + ".before";
    fs::copy_file(file, before, fs::copy_options::overwrite_existing);
    base::write_file(file, text);
    try {
      if (has_pose(study, object, world_from_object)) {
        fs::remove(before);
        return file;
      }
    } catch (const config::ConfigError&) {  // the pose is not permitted, or the edit has failed
    }
    fs::rename(before, file);
    break;
  }
  throw base::UsageError(
      fmt::format("the scene file does not have {} with one key per line, or does not permit the "
                  "pose; write position_m and rotation_deg yourself",
                  object));
}

}  // namespace fivepipe::study
