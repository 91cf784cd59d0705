// Values of YAML keys: types, lengths, ranges.
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "common/config/yaml/yaml_reader.h"

namespace fivepipe::config {

std::optional<Settings::Expanded> YamlMap::scalar(const YAML::Node& node, const std::string& what) {
  if (!node.IsDefined()) return std::nullopt;
  if (!node.IsScalar()) {
    report(location_of_mark(node.Mark()), what + " must be a single value, is " + kind_of(node));
    return std::nullopt;
  }
  if (context_->settings == nullptr) return Settings::Expanded{node.Scalar()};
  const Settings::Expanded expanded =
      context_->settings->expand(node.Scalar(), location_of_mark(node.Mark()), *context_->problems);
  if (!expanded.usable) return std::nullopt;
  return expanded;
}

std::optional<double> YamlMap::finite_number(const YAML::Node& node, const std::string& what,
                                             Range range) {
  const auto text = scalar(node, what);
  if (!text) return std::nullopt;
  const ParsedNumber number = parse_number(text->text);
  const SourceLocation location = location_of_mark(node.Mark());
  if (!number.is_number) {
    report(location, what + " must be a number, is \"" + text->text + '"');
  } else if (!std::isfinite(number.value)) {
    report(location, what + " must be finite, is " + text->text);
  } else if (!contains(range, number.value)) {
    report(location, what + " must be " + text_of(range) + ", is " + text->text);
  } else {
    return number.value;
  }
  return std::nullopt;
}

std::optional<std::int64_t> YamlMap::whole_number(const YAML::Node& node, const std::string& what,
                                                  Range range) {
  const auto number = finite_number(node, what, range);
  if (!number) return std::nullopt;
  if (*number == std::floor(*number)) return std::int64_t(*number);
  report(location_of_mark(node.Mark()), what + " must be a whole number, is " + node.Scalar());
  return std::nullopt;
}

std::optional<std::vector<YAML::Node>> YamlMap::list(const YAML::Node& node,
                                                     const std::string& what, std::size_t length) {
  if (!node.IsDefined()) return std::nullopt;
  if (node.IsSequence() && node.size() == length)
    return std::vector<YAML::Node>(node.begin(), node.end());
  report(location_of_mark(node.Mark()),
         what + " must be a list of " + std::to_string(length) + ", is " + kind_of(node));
  return std::nullopt;
}

std::optional<Eigen::Vector3d> YamlMap::three_numbers(const YAML::Node& node,
                                                      const std::string& what, Range each) {
  const auto elements = list(node, what, 3);
  if (!elements) return std::nullopt;
  Eigen::Vector3d vector;
  bool is_good = true;
  for (int i = 0; i < 3; ++i) {
    const auto number = finite_number((*elements)[i], what + '[' + std::to_string(i) + ']', each);
    is_good = is_good && number;
    vector[i] = number.value_or(0);
  }
  if (!is_good) return std::nullopt;
  return vector;
}

double YamlMap::number(const std::string& key, Range range, std::optional<double> default_value) {
  return finite_number(value_of(key, !default_value), key, range)
      .value_or(default_value.value_or(0));
}

int YamlMap::integer(const std::string& key, Range range, std::optional<int> default_value) {
  range.min = std::max<double>(range.min, std::numeric_limits<int>::min());
  range.max = std::min<double>(range.max, std::numeric_limits<int>::max());
  return int(
      whole_number(value_of(key, !default_value), key, range).value_or(default_value.value_or(0)));
}

std::int64_t YamlMap::integer64(const std::string& key, Range range,
                                std::optional<std::int64_t> default_value) {
  // 2^53: larger integers are not exact in a double.
  constexpr double kMaxExactInteger = 9007199254740992;
  range.min = std::max(range.min, -kMaxExactInteger);
  range.max = std::min(range.max, kMaxExactInteger);
  return whole_number(value_of(key, !default_value), key, range)
      .value_or(default_value.value_or(0));
}

bool YamlMap::flag(const std::string& key, std::optional<bool> default_value) {
  const YAML::Node node = value_of(key, !default_value);
  const auto text = scalar(node, key);
  if (text && text->text != "true" && text->text != "false")
    report(location_of_mark(node.Mark()), key + " must be true or false, is \"" + text->text + '"');
  return text && (text->text == "true" || text->text == "false") ? text->text == "true"
                                                                 : default_value.value_or(false);
}

std::string YamlMap::text(const std::string& key, std::optional<std::string> default_value) {
  const auto text = scalar(value_of(key, !default_value), key);
  return text ? text->text : default_value.value_or("");
}

std::string YamlMap::name(const std::string& key, std::optional<std::string> default_value,
                          std::size_t max_length) {
  const YAML::Node node = value_of(key, !default_value);
  const auto text = scalar(node, key);
  if (!text) return default_value.value_or("");
  if (text->text.empty() ||
      text->text.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") != std::string::npos)
    report(location_of_mark(node.Mark()),
           key + " must consist of a-z, 0-9 and _, is \"" + text->text + '"');
  if (text->text.size() > max_length)
    report(location_of_mark(node.Mark()), fmt::format("{} has {} characters, the limit is {}", key,
                                                      text->text.size(), max_length));
  return text->text;
}

Eigen::Vector3d YamlMap::vector3(const std::string& key, Range each,
                                 std::optional<Eigen::Vector3d> default_value) {
  return three_numbers(value_of(key, !default_value), key, each)
      .value_or(default_value.value_or(Eigen::Vector3d::Zero()));
}

std::optional<Eigen::Vector3d> YamlMap::direction(const std::string& key) {
  if (!has(key)) return {};
  const Eigen::Vector3d value = vector3(key, kAnyDirection, Eigen::Vector3d::UnitX());
  if (value.norm() > 0) return value;
  problem_at(key, key + " must not be zero: it is a direction");
  return {};
}

std::array<double, 3> YamlMap::rgb(const std::string& key,
                                   const std::array<double, 3>& default_value) {
  const Eigen::Vector3d rgb = vector3(key, kUnitRange, Eigen::Vector3d(default_value.data()));
  return {rgb.x(), rgb.y(), rgb.z()};
}

Eigen::Matrix3d YamlMap::matrix3(const std::string& key) {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
  if (const auto rows = list(value_of(key, true), key, 3))
    for (int i = 0; i < 3; ++i)
      if (const auto row = three_numbers((*rows)[i], key + '[' + std::to_string(i) + ']', kAny))
        matrix.row(i) = row->transpose();
  return matrix;
}

std::array<int, 2> YamlMap::size_px(const std::string& key,
                                    std::optional<std::array<int, 2>> default_value) {
  std::array<int, 2> size = default_value.value_or(std::array<int, 2>{0, 0});
  if (const auto elements = list(value_of(key, !default_value), key, 2))
    for (int i = 0; i < 2; ++i)
      size[i] = int(
          whole_number((*elements)[i], key + '[' + std::to_string(i) + ']', {1, kMaxImageSize_px})
              .value_or(0));
  return size;
}

std::optional<std::array<double, 2>> YamlMap::interval(const std::string& key, Range each) {
  const auto elements = list(value_of(key, true), key, 2);
  if (!elements) return std::nullopt;
  const auto from = finite_number((*elements)[0], key + "[0]", each),
             to = finite_number((*elements)[1], key + "[1]", each);
  if (!from || !to) return std::nullopt;
  return std::array<double, 2>{*from, *to};
}

std::vector<int> YamlMap::integers(const std::string& key, Range each) {
  std::vector<int> result;
  const YAML::Node node = value_of(key, false);
  if (!node.IsDefined()) return result;
  if (!node.IsSequence()) {
    report(location_of_mark(node.Mark()), key + " must be a list, is " + kind_of(node));
    return result;
  }
  for (std::size_t i = 0; i < node.size(); ++i)
    if (const auto number = whole_number(node[i], key + '[' + std::to_string(i) + ']', each))
      result.push_back(int(*number));
  return result;
}

std::filesystem::path YamlMap::path(const std::string& key) {
  const YAML::Node node = value_of(key, true);
  const auto text = scalar(node, key);
  if (!text) return {};
  if (text->text.empty()) {
    report(location_of_mark(node.Mark()), key + " must be a path, is empty");
    return {};
  }
  const std::filesystem::path path = text->text;
  if (path.is_absolute()) return path;
  const std::filesystem::path base = text->starts_on_command_line
                                         ? std::filesystem::current_path()
                                         : std::filesystem::absolute(file()).parent_path();
  return (base / path).lexically_normal();
}

std::optional<std::size_t> YamlMap::choice_index(const std::string& key,
                                                 const std::vector<std::string>& names,
                                                 bool required) {
  const YAML::Node node = value_of(key, required);
  if (const auto missing = missing_.find(key); missing != missing_.end())
    missing->second = fmt::format("set it to one of {}", fmt::join(names, ", "));
  return index_of_name(node, key, names);
}

std::optional<std::size_t> YamlMap::index_of_name(const YAML::Node& node, const std::string& what,
                                                  const std::vector<std::string>& names) {
  const auto text = scalar(node, what);
  if (!text) return std::nullopt;
  const auto found = std::find(names.begin(), names.end(), text->text);
  if (found != names.end()) return found - names.begin();
  report(location_of_mark(node.Mark()),
         fmt::format("{} must be one of {}; is \"{}\"", what, fmt::join(names, ", "), text->text));
  return std::nullopt;
}

std::vector<std::pair<std::size_t, SourceLocation>> YamlMap::choice_indices(
    const std::string& key, const std::vector<std::string>& names) {
  std::vector<std::pair<std::size_t, SourceLocation>> result;
  const YAML::Node node = value_of(key, false);
  if (!node.IsDefined()) return result;
  if (!node.IsSequence()) {
    report(location_of_mark(node.Mark()), key + " must be a list, is " + kind_of(node));
    return result;
  }
  std::set<std::size_t> listed;
  for (std::size_t i = 0; i < node.size(); ++i) {
    const std::string what = key + '[' + std::to_string(i) + ']';
    const auto index = index_of_name(node[i], what, names);
    if (!index) continue;
    const SourceLocation location = location_of_mark(node[i].Mark());
    if (listed.insert(*index).second)
      result.emplace_back(*index, location);
    else
      report(location, what + " repeats " + names[*index] + ": remove it");
  }
  return result;
}

}  // namespace fivepipe::config
