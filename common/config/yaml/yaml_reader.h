// YAML -> checked values. Every problem is collected with its location, and reading goes on: a
// value that can't be had reads as its default (or zero), so one load finds all problems of a file.
#pragma once
#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/config/yaml/problems.h"
#include "common/config/yaml/settings.h"

namespace fivepipe::config {

// Allowed values, bounds included unless stated.
struct Range {
  double min, max;
  bool min_excluded = false;
};

// Why a file can't be read (absent, a directory, no permission); nothing where it can.
std::optional<std::string> why_unreadable(const std::filesystem::path& file);

// One mapping of a YAML file. Keys that are asked for are the known ones; finish() reports the
// rest.
class YamlMap {
 public:
  // The mapping at the top of a file; void (see is_void) where the file can't be read, is no YAML
  // or holds no mapping.
  static YamlMap load(const std::filesystem::path& file, Problems& problems);

  // From here on ${key} in this mapping and those below are replaced. `settings` must outlive them.
  void use_settings(Settings& settings);

  // A void mapping stands for one that could not be read: everything in it reads as absent, without
  // further problems.
  bool is_void() const { return !node_.IsDefined() || !node_.IsMap(); }
  bool has(const std::string& key);

  // Values. Without `default_value` the key must be there. Lengths and types are checked; numbers
  // are finite and in range.
  double number(const std::string& key, Range range, std::optional<double> default_value = {});
  int integer(const std::string& key, Range range, std::optional<int> default_value = {});
  std::int64_t integer64(const std::string& key, Range range,
                         std::optional<std::int64_t> default_value = {});
  bool flag(const std::string& key, std::optional<bool> default_value = {});
  std::string text(const std::string& key, std::optional<std::string> default_value = {});
  std::string name(const std::string& key, std::optional<std::string> default_value = {},
                   std::size_t max_length = 32);  // [a-z0-9_]+, as messages have room for
  Eigen::Vector3d vector3(const std::string& key, Range each,
                          std::optional<Eigen::Vector3d> default_value = {});
  Eigen::Matrix3d matrix3(const std::string& key);  // a list of three rows
  std::array<int, 2> size_px(
      const std::string& key,
      std::optional<std::array<int, 2>> default_value = {});      // width, height
  std::vector<int> integers(const std::string& key, Range each);  // absent: none

  // A path, relative to the folder of the file, or to the working directory where it begins with a
  // setting from the command line; empty where it could not be read.
  std::filesystem::path path(const std::string& key);

  template <typename Value>
  Value choice(const std::string& key, const std::vector<std::pair<std::string, Value>>& choices,
               std::optional<Value> default_value = {}) {
    std::vector<std::string> names;
    for (const auto& [choice_name, value] : choices) names.push_back(choice_name);
    const std::optional<std::size_t> index = choice_index(key, names, !default_value);
    return index ? choices[*index].second : default_value.value_or(choices.front().second);
  }

  YamlMap map(const std::string& key);                // must be there; void where it is not
  std::vector<YamlMap> maps(const std::string& key);  // a list of mappings, at least one
  std::vector<std::string> keys()
      const;  // as they stand in the file, for mappings whose keys are free
  bool is_text(const std::string& key);  // the key holds a scalar

  // Reports unknown keys, and missing ones. An unknown key that looks like a missing one (other
  // unit, spelling) is one problem.
  void finish();
  void
  report_missing();  // finish() without the unknown keys, for a mapping whose keys can't be known

  void problem(const std::string& what) const { report(location(), what); }
  void problem_at(const std::string& key, const std::string& what) const {
    report(location_of(key), what);
  }  // at the key's value
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
  void report(SourceLocation location, const std::string& what) const;

  std::shared_ptr<Context> context_;
  YAML::Node node_;
  std::string what_;  // how messages call this mapping
  std::vector<std::string> known_;
  std::set<std::string> missing_;
};

}  // namespace fivepipe::config
