#include "common/config/yaml/settings.h"

#include <fmt/ranges.h>

#include <vector>

namespace fivepipe::config {

Settings::Settings(std::filesystem::path file, SourceLocation location,
                   std::map<std::string, Setting> defaults,
                   const std::map<std::string, std::string>& overrides, Problems& problems)
    : file_(std::move(file)), settings_(std::move(defaults)) {
  for (const auto& [key, value] : overrides) {
    const auto known = settings_.find(key);
    if (known == settings_.end()) {
      problems.add(file_, location, "--set " + key + ": unknown setting; " + known_keys());
      continue;
    }
    known->second.value = value;
    known->second.from_command_line = true;
  }
}

std::string Settings::known_keys() const {
  if (settings_.empty()) return "this file has no settings";
  std::vector<std::string> keys;
  for (const auto& [key, setting] : settings_) keys.push_back(key);
  return fmt::format("known settings: {}", fmt::join(keys, ", "));
}

Settings::Expanded Settings::expand(const std::string& text, SourceLocation location,
                                    Problems& problems) {
  Expanded result;
  std::size_t at = 0;
  while (true) {
    const std::size_t open = text.find("${", at);
    result.text += text.substr(at, open - at);
    if (open == std::string::npos) return result;
    const std::size_t close = text.find('}', open);
    if (close == std::string::npos) {
      problems.add(file_, location, "${ without a closing }");
      result.usable = false;
      return result;
    }
    const std::string key = text.substr(open + 2, close - open - 2);
    at = close + 1;
    const auto known = settings_.find(key);
    if (known == settings_.end()) {
      problems.add(file_, location, "${" + key + "}: unknown setting; " + known_keys());
      result.usable = false;
    } else if (known->second.value.empty()) {
      const bool is_folder = at < text.size() && text[at] == '/';
      if (reported_empty_.insert(key).second)
        problems.add(file_, known->second.location,
                     key + " is not set: pass --set " + key + (is_folder ? "=FOLDER" : "=VALUE"));
      result.usable = false;
    } else {
      if (open == 0) result.starts_on_command_line = known->second.from_command_line;
      result.text += known->second.value;
    }
  }
}

}  // namespace fivepipe::config
