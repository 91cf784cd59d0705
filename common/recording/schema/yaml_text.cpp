#include "common/recording/schema/yaml_text.h"

#include <yaml-cpp/emitter.h>
#include <yaml-cpp/emittermanip.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>

namespace fivepipe::schema {
namespace {

using Json = nlohmann::ordered_json;

// True if YAML reads the unquoted text as a string. The emitter does not quote "no" or "12".
bool is_plain(const std::string& text) {
  static const std::set<std::string> not_strings = {"true", "false", "null", "yes",
                                                    "no",   "on",    "off"};
  std::string lower;
  for (char c : text) lower += char(std::tolower(static_cast<unsigned char>(c)));
  const auto is_allowed = [](unsigned char c) {
    return c < 128 && (std::isalnum(c) || c == '_' || c == '<' || c == '>');
  };
  return !text.empty() && std::isalpha(static_cast<unsigned char>(text[0])) &&
         !not_strings.contains(lower) && std::all_of(text.begin(), text.end(), is_allowed);
}

void emit_string(YAML::Emitter& yaml, const std::string& text) {
  if (is_plain(text))
    yaml << text;
  else
    yaml << YAML::DoubleQuoted << text;
}

void emit_scalar(YAML::Emitter& yaml, const Json& value) {
  const double number = value.is_number_float() ? value.get<double>() : 0.0;
  if (value.is_null())
    yaml << YAML::Null;
  else if (value.is_string())
    emit_string(yaml, value.get_ref<const std::string&>());
  else if (!std::isfinite(number))
    yaml << (std::isnan(number) ? ".nan" : number > 0 ? ".inf" : "-.inf");
  else
    yaml << value.dump();
}

bool is_flat(const Json& value) {
  return std::none_of(value.begin(), value.end(),
                      [](const Json& inner) { return inner.is_structured(); });
}

void emit(YAML::Emitter& yaml, const Json& value, bool on_one_line) {
  if (!value.is_structured()) return emit_scalar(yaml, value);
  yaml << (on_one_line ? YAML::Flow : YAML::Block);
  yaml << (value.is_object() ? YAML::BeginMap : YAML::BeginSeq);
  for (const auto& [key, inner] : value.items()) {
    if (value.is_object()) {
      yaml << YAML::Key;
      emit_string(yaml, key);
      yaml << YAML::Value;
    }
    emit(yaml, inner, is_flat(inner));
  }
  yaml << (value.is_object() ? YAML::EndMap : YAML::EndSeq);
}

}  // namespace

std::string to_yaml(const Json& message) {
  YAML::Emitter yaml;
  yaml.SetNullFormat(YAML::LowerNull);
  emit(yaml, message, message.empty());
  return "---\n" + std::string(yaml.c_str(), yaml.size()) + "\n";
}

}  // namespace fivepipe::schema
