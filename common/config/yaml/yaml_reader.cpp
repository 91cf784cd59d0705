#include "common/config/yaml/yaml_reader.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <sstream>

#include "common/config/yaml/key_suggestion.h"

namespace fivepipe::config {

namespace {

constexpr int kMaxImageSize_px = 16384;  // common limit of GL textures

SourceLocation location_of_mark(const YAML::Mark& mark) {
  return mark.is_null() ? SourceLocation{} : SourceLocation{mark.line + 1, mark.column + 1};
}

std::string text_of(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.10g", value);
  return text;
}

std::string text_of(Range range) {
  const std::string min = (range.min_excluded ? "greater than " : "at least ") + text_of(range.min);
  if (!std::isfinite(range.min)) return "at most " + text_of(range.max);
  if (!std::isfinite(range.max)) return min;
  return range.min_excluded ? min + " and at most " + text_of(range.max)
                            : "from " + text_of(range.min) + " to " + text_of(range.max);
}

bool contains(Range range, double value) {
  return (range.min_excluded ? value > range.min : value >= range.min) && value <= range.max;
}

// Describes the content of a node, for messages.
std::string kind_of(const YAML::Node& node) {
  switch (node.Type()) {
    case YAML::NodeType::Sequence: return "a list of " + std::to_string(node.size());
    case YAML::NodeType::Map: return "a mapping";
    case YAML::NodeType::Scalar: return '"' + node.Scalar() + '"';
    default: return "nothing";
  }
}

struct ParsedNumber {
  bool is_number = false;
  double value = 0;  // infinite also if the text overflows a double
};

ParsedNumber parse_number(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  const bool is_negative = text.starts_with('-');
  if (is_negative || text.starts_with('+')) text.erase(0, 1);
  if (text == ".inf" || text == "inf" || text == "infinity")
    return {true, std::numeric_limits<double>::infinity()};
  if (text == ".nan" || text == "nan") return {true, std::numeric_limits<double>::quiet_NaN()};
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (end != text.data() + text.size() || text.empty() || text.front() == '-') return {};
  if (error == std::errc::result_out_of_range)
    return {true, std::numeric_limits<double>::infinity()};
  if (error != std::errc()) return {};
  return {true, is_negative ? -value : value};
}

}  // namespace

std::optional<std::string> why_unreadable(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return "there is no such file";
  if (std::filesystem::is_directory(file, error)) return "is a directory, not a file";
  if (!std::ifstream(file)) return "can't be read (no permission?)";
  return std::nullopt;
}

YamlMap YamlMap::load(const std::filesystem::path& file, Problems& problems) {
  const auto context = std::make_shared<Context>(Context{file, &problems, nullptr});
  const YamlMap nothing(context, YAML::Node(YAML::NodeType::Undefined), "the file");
  if (const auto why = why_unreadable(file)) {
    nothing.report({}, *why);
    return nothing;
  }
  try {
    std::ifstream in(file);
    const std::vector<YAML::Node> documents = YAML::LoadAll(in);
    if (documents.size() == 1 && documents[0].IsMap())
      return YamlMap(context, documents[0], "the file");
    if (documents.size() > 1)
      nothing.report(location_of_mark(documents[1].Mark()),
                     "a second YAML document; only one is expected");
    else
      nothing.report({1, 1}, "a mapping of keys to values is expected");
  } catch (const YAML::Exception& error) {
    nothing.report(location_of_mark(error.mark), "not YAML: " + error.msg);
  }
  return nothing;
}

YamlMap::YamlMap(std::shared_ptr<Context> context, YAML::Node node, std::string what)
    : context_(std::move(context)), node_(std::move(node)), what_(std::move(what)) {
  if (is_void()) return;
  std::map<std::string, int> line_of_key;
  for (const auto& entry : node_) {
    const SourceLocation location = location_of_mark(entry.first.Mark());
    if (!entry.first.IsScalar()) {
      report(location, "a key must be a word, is " + kind_of(entry.first));
      continue;
    }
    const auto [first, is_new] = line_of_key.try_emplace(entry.first.Scalar(), location.line);
    if (!is_new)
      report(location, entry.first.Scalar() + " is there twice, first in line " +
                           std::to_string(first->second));
  }
}

void YamlMap::use_settings(Settings& settings) { context_->settings = &settings; }

void YamlMap::report(SourceLocation location, const std::string& what) const {
  context_->problems->add(context_->file, location, what);
}

SourceLocation YamlMap::location() const {
  return is_void() ? SourceLocation{} : location_of_mark(node_.Mark());
}

SourceLocation YamlMap::location_of(const std::string& key) const {
  if (!is_void())
    for (const auto& entry : node_)
      if (entry.first.IsScalar() && entry.first.Scalar() == key)
        return location_of_mark(entry.second.IsNull() ? entry.first.Mark() : entry.second.Mark());
  return location();
}

std::vector<std::string> YamlMap::keys() const {
  std::vector<std::string> result;
  if (!is_void())
    for (const auto& entry : node_)
      if (entry.first.IsScalar() &&
          std::find(result.begin(), result.end(), entry.first.Scalar()) == result.end())
        result.push_back(entry.first.Scalar());
  return result;
}

YAML::Node YamlMap::value_of(const std::string& key, bool required) {
  if (std::find(known_.begin(), known_.end(), key) == known_.end()) known_.push_back(key);
  if (is_void()) return YAML::Node(YAML::NodeType::Undefined);
  for (const auto& entry : node_)
    if (entry.first.IsScalar() && entry.first.Scalar() == key) {
      if (!entry.second.IsNull()) return entry.second;
      report(location_of_mark(entry.first.Mark()), key + " has no value");
      return YAML::Node(YAML::NodeType::Undefined);
    }
  if (required) missing_.insert(key);
  return YAML::Node(YAML::NodeType::Undefined);
}

bool YamlMap::has(const std::string& key) {
  if (std::find(known_.begin(), known_.end(), key) == known_.end()) known_.push_back(key);
  const auto present = keys();
  return std::find(present.begin(), present.end(), key) != present.end();
}

bool YamlMap::is_text(const std::string& key) {
  return value_of(key, false).IsDefined() && value_of(key, false).IsScalar();
}

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
    report(location_of_mark(node.Mark()), key + " has " + std::to_string(text->text.size()) +
                                              " characters, at most " + std::to_string(max_length) +
                                              " are possible");
  return text->text;
}

Eigen::Vector3d YamlMap::vector3(const std::string& key, Range each,
                                 std::optional<Eigen::Vector3d> default_value) {
  return three_numbers(value_of(key, !default_value), key, each)
      .value_or(default_value.value_or(Eigen::Vector3d::Zero()));
}

Eigen::Matrix3d YamlMap::matrix3(const std::string& key) {
  constexpr double kUnbounded = std::numeric_limits<double>::max();
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
  if (const auto rows = list(value_of(key, true), key, 3))
    for (int i = 0; i < 3; ++i)
      if (const auto row = three_numbers((*rows)[i], key + '[' + std::to_string(i) + ']',
                                         {-kUnbounded, kUnbounded}))
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
  const auto text = scalar(node, key);
  if (!text) return std::nullopt;
  const auto found = std::find(names.begin(), names.end(), text->text);
  if (found != names.end()) return found - names.begin();
  std::string list_of_names;
  for (const std::string& name : names) list_of_names += (list_of_names.empty() ? "" : ", ") + name;
  report(location_of_mark(node.Mark()),
         key + " must be one of " + list_of_names + "; is \"" + text->text + '"');
  return std::nullopt;
}

YamlMap YamlMap::map(const std::string& key) {
  YAML::Node node = value_of(key, true);
  if (node.IsDefined() && !node.IsMap())
    report(location_of_mark(node.Mark()),
           key + " must be a mapping of keys to values, is " + kind_of(node));
  return YamlMap(context_, node, key);
}

std::vector<YamlMap> YamlMap::maps(const std::string& key) {
  std::vector<YamlMap> result;
  const YAML::Node node = value_of(key, true);
  if (!node.IsDefined()) return result;
  if (!node.IsSequence() || node.size() == 0) {
    report(location_of_mark(node.Mark()),
           key + " must be a list of at least one, is " + kind_of(node));
    return result;
  }
  for (std::size_t i = 0; i < node.size(); ++i) {
    const std::string what = key + '[' + std::to_string(i) + ']';
    if (!node[i].IsMap())
      report(location_of_mark(node[i].Mark()),
             what + " must be a mapping of keys to values, is " + kind_of(node[i]));
    result.push_back(YamlMap(context_, node[i], what));
  }
  return result;
}

void YamlMap::finish() {
  if (is_void()) return;
  for (const auto& entry : node_) {
    if (!entry.first.IsScalar()) continue;
    const std::string key = entry.first.Scalar();
    if (std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
    std::string what = "unknown key " + key;
    if (const auto suggestion = suggest_key(key, known_)) {
      what += suggestion->unit_differs ? ": " + suggestion->key + " is expected"
                                       : ": did you mean " + suggestion->key + '?';
      missing_.erase(suggestion->key);
    } else {
      what += "; known keys:";
      for (const std::string& known : known_) what += ' ' + known;
    }
    report(location_of_mark(entry.first.Mark()), what);
  }
  report_missing();
}

void YamlMap::report_missing() {
  for (const std::string& key : missing_) report(location(), key + " is missing in " + what_);
  missing_.clear();
}

}  // namespace fivepipe::config
