// Reads checked values from YAML. Collects every problem with its location and continues: an
// unusable value reads as its default (or zero), so that one load finds all problems of a file.
#pragma once
#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/config/yaml/numbers.h"
#include "common/config/yaml/problems.h"
#include "common/config/yaml/settings.h"

namespace fivepipe::config {

// Converts a YAML mark, which counts from 0. A null mark has no position.
SourceLocation location_of_mark(const YAML::Mark& mark);
// Describes a node's content for messages.
std::string kind_of(const YAML::Node& node);

// Common limit of GL textures.
inline constexpr int kMaxImageSize_px = 16384;

// One mapping of a YAML file. The keys that the caller queries become the known keys; finish()
// reports all others.
class YamlMap {
 public:
  // Returns the top-level mapping of a file. If the file cannot be read, is not YAML or contains no
  // mapping, adds a problem and returns a void mapping (see is_void). `problems` must outlive it.
  static YamlMap load(const std::filesystem::path& file, Problems& problems);

  // Enables the replacement of ${key} in this mapping and the mappings below. `settings` must
  // outlive them.
  void use_settings(Settings& settings);

  // True if this mapping stands for one that could not be read: all its keys read as absent,
  // without further problems.
  bool is_void() const { return !node_.IsDefined() || !node_.IsMap(); }
  // True if the mapping contains the key, also without a value.
  bool has(const std::string& key);

  // Values. Without `default_value` a missing key is a problem. These functions check types and
  // lengths, and that numbers are finite and in range.
  double number(const std::string& key, Range range, std::optional<double> default_value = {});
  int integer(const std::string& key, Range range, std::optional<int> default_value = {});
  std::int64_t integer64(const std::string& key, Range range,
                         std::optional<std::int64_t> default_value = {});
  bool flag(const std::string& key, std::optional<bool> default_value = {});
  std::string text(const std::string& key, std::optional<std::string> default_value = {});
  // [a-z0-9_]+, at most max_length characters: the bound of the names in messages.
  std::string name(const std::string& key, std::optional<std::string> default_value = {},
                   std::size_t max_length = 32);
  Eigen::Vector3d vector3(const std::string& key, Range each,
                          std::optional<Eigen::Vector3d> default_value = {});
  // A direction of any length. Returns nullopt if the key is absent; zero is a problem.
  std::optional<Eigen::Vector3d> direction(const std::string& key);
  // A colour, each component 0 to 1.
  std::array<double, 3> rgb(const std::string& key, const std::array<double, 3>& default_value);
  Eigen::Matrix3d matrix3(const std::string& key);  // a list of three rows
  // Width and height.
  std::array<int, 2> size_px(const std::string& key,
                             std::optional<std::array<int, 2>> default_value = {});
  // A list of two numbers, in any order. A missing key is a problem. Returns nullopt if the value
  // is unusable.
  std::optional<std::array<double, 2>> interval(const std::string& key, Range each);
  // Returns an empty list if the key is absent.
  std::vector<int> integers(const std::string& key, Range each);

  // A path, relative to the folder of the file, or to the working directory if it begins with a
  // setting from the command line. Returns an empty path if the value is unusable.
  std::filesystem::path path(const std::string& key);

  // Returns the value whose name the key holds.
  template <typename Value>
  Value choice(const std::string& key, const std::vector<std::pair<std::string, Value>>& choices,
               std::optional<Value> default_value = {}) {
    std::vector<std::string> names;
    for (const auto& [choice_name, value] : choices) names.push_back(choice_name);
    const std::optional<std::size_t> index = choice_index(key, names, !default_value);
    return index ? choices[*index].second : default_value.value_or(choices.front().second);
  }

  // Returns the values whose names a list holds, in its order, each with its location. Returns an
  // empty list if the key is absent. A repeated name is a problem.
  template <typename Value>
  std::vector<std::pair<Value, SourceLocation>> choices(
      const std::string& key, const std::vector<std::pair<std::string, Value>>& choices) {
    std::vector<std::string> names;
    for (const auto& [choice_name, value] : choices) names.push_back(choice_name);
    std::vector<std::pair<Value, SourceLocation>> chosen;
    for (const auto& [index, location] : choice_indices(key, names))
      chosen.emplace_back(choices[index].second, location);
    return chosen;
  }

  // Returns the mapping below a key. A missing key is a problem and returns a void mapping.
  YamlMap map(const std::string& key);
  // Returns the mappings of a list. An empty or missing list is a problem.
  std::vector<YamlMap> maps(const std::string& key);
  // Returns all keys in the order of the file, for mappings whose keys the user chooses.
  std::vector<std::string> keys() const;
  // True if the key holds a scalar.
  bool is_text(const std::string& key);

  // Reports unknown and missing keys. An unknown key that resembles a missing one (other unit or
  // spelling) is one problem, not two.
  void finish();
  // Reports only missing keys, for a mapping whose known keys cannot be determined.
  void report_missing();

  // Reports a problem at the mapping, or at a key's value.
  void problem(const std::string& what) const { report(location(), what); }
  void problem_at(const std::string& key, const std::string& what) const {
    report(location_of(key), what);
  }
  SourceLocation location() const;
  SourceLocation location_of(const std::string& key) const;
  const std::filesystem::path& file() const { return context_->file; }
  std::size_t problem_count() const { return context_->problems->count(); }
  Problems& problems() const { return *context_->problems; }

 private:
  struct Context {
    std::filesystem::path file;
    Problems* problems;
    Settings* settings = nullptr;
  };

  YamlMap(std::shared_ptr<Context> context, YAML::Node node, std::string what);
  YAML::Node value_of(const std::string& key, bool required);
  std::optional<Settings::Expanded> scalar(const YAML::Node& node, const std::string& what);
  std::optional<double> finite_number(const YAML::Node& node, const std::string& what, Range range);
  std::optional<std::int64_t> whole_number(const YAML::Node& node, const std::string& what,
                                           Range range);
  std::optional<std::vector<YAML::Node>> list(const YAML::Node& node, const std::string& what,
                                              std::size_t length);
  std::optional<Eigen::Vector3d> three_numbers(const YAML::Node& node, const std::string& what,
                                               Range each);
  std::optional<std::size_t> choice_index(const std::string& key,
                                          const std::vector<std::string>& names, bool required);
  std::optional<std::size_t> index_of_name(const YAML::Node& node, const std::string& what,
                                           const std::vector<std::string>& names);
  std::vector<std::pair<std::size_t, SourceLocation>> choice_indices(
      const std::string& key, const std::vector<std::string>& names);
  void report(SourceLocation location, const std::string& what) const;

  std::shared_ptr<Context> context_;
  YAML::Node node_;
  std::string what_;  // name of this mapping in messages
  std::vector<std::string> known_;
  // Missing required keys, each with a hint for the message, which may be empty.
  std::map<std::string, std::string> missing_;
};

}  // namespace fivepipe::config
