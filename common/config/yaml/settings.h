// The ${key} settings of a deployment. The file's `settings:` are the defaults; --set KEY=VALUE
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
  // Reports each override whose key the file's `settings:` lack as a problem at `location`.
  Settings(std::filesystem::path file, SourceLocation location,
           std::map<std::string, Setting> defaults,
           const std::map<std::string, std::string>& overrides, Problems& problems);

  // Replaces each ${key} in `text`. An unknown key or an empty value is a problem and sets `usable`
  // to false.
  struct Expanded {
    std::string text;
    bool usable = true;
    // True if the text begins with a value of --set: a path is then relative to the working
    // directory.
    bool starts_on_command_line = false;
  };
  Expanded expand(const std::string& text, SourceLocation location, Problems& problems);

 private:
  std::string known_keys() const;

  std::filesystem::path file_;
  std::map<std::string, Setting> settings_;
  std::set<std::string> reported_empty_;
};

}  // namespace fivepipe::config
