#include "common/recording/schema/yaml_text.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>

namespace fivepipe::schema {
namespace {

using Json = nlohmann::ordered_json;

// True if YAML reads the unquoted text as a string.
bool is_plain(const std::string& text) {
  static const std::set<std::string> read_otherwise = {"true", "false", "null", "yes",
                                                       "no",   "on",    "off"};
  std::string lower;
  for (char c : text) lower += char(std::tolower(static_cast<unsigned char>(c)));
  const auto is_allowed = [](unsigned char c) {
    return c < 128 && (std::isalnum(c) || c == '_' || c == '<' || c == '>');
  };
  return !text.empty() && std::isalpha(static_cast<unsigned char>(text[0])) &&
         !read_otherwise.contains(lower) && std::all_of(text.begin(), text.end(), is_allowed);
}

std::string scalar(const Json& value) {
  if (value.is_string() && is_plain(value.get_ref<const std::string&>())) return value;
  if (const double number = value.is_number_float() ? value.get<double>() : 0.0;
      !std::isfinite(number))
    return std::isnan(number) ? ".nan" : number > 0 ? ".inf" : "-.inf";
  return value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

bool is_flat(const Json& value) {
  return std::none_of(value.begin(), value.end(),
                      [](const Json& inner) { return inner.is_structured(); });
}

std::string on_one_line(const Json& value) {
  if (!value.is_structured()) return scalar(value);
  std::string text;
  for (const auto& [key, inner] : value.items())
    text += (text.empty() ? "" : ", ") + (value.is_object() ? scalar(key) + ": " : "") +
            on_one_line(inner);
  return value.is_object() ? "{" + text + "}" : "[" + text + "]";
}

void write(const Json& value, std::size_t indent, std::string& text) {
  for (const auto& [key, inner] : value.items()) {
    // The line that starts with "- " is already indented.
    if (text.back() == '\n') text += std::string(indent, ' ');
    text += value.is_object() ? scalar(key) + ":" : "-";
    if (is_flat(inner)) {
      text += " " + on_one_line(inner) + "\n";
    } else {
      text += value.is_object() ? "\n" : " ";
      write(inner, indent + 2, text);
    }
  }
}

}  // namespace

std::string to_yaml(const Json& message) {
  std::string text = "---\n";
  if (message.is_structured() && !message.empty())
    write(message, 0, text);
  else
    text += on_one_line(message) + "\n";
  return text;
}

}  // namespace fivepipe::schema
