// The ${key} settings of a deployment: the file's `settings:` are the defaults, --set KEY=VALUE
// overrides them.
#pragma once
#include <filesystem>
#include <map>
#include <set>
#include <string>

#include "common/config/yaml/problems.h"

namespace fivepipe::config {

struct Setting {
  std::string value;
  bool from_command_line = false;
  SourceLocation location;  // in the deployment file
};

class Settings {
 public:
  // Overrides that the file does not know are problems of the file's `settings:`, at `location`.
  Settings(std::filesystem::path file, SourceLocation location,
           std::map<std::string, Setting> defaults,
           const std::map<std::string, std::string>& overrides, Problems& problems);

  // Text with each ${key} replaced. A key that is unknown or set to nothing is a problem and makes
  // `usable` false.
  struct Expanded {
    std::string text;
    bool usable = true;
    bool starts_on_command_line =
        false;  // the text begins with a value of --set: relative to the working directory
  };
  Expanded expand(const std::string& text, SourceLocation location, Problems& problems);

 private:
  std::string known_keys() const;

  std::filesystem::path file_;
  std::map<std::string, Setting> settings_;
  std::set<std::string> reported_empty_;
};

}  // namespace fivepipe::config
