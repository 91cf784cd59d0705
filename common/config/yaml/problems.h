// Collects the problems of all files of one load, so that they are reported together.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "common/config/yaml/config_error.h"

namespace fivepipe::config {

// Position in a text file, both from 1; 0 where there is none.
struct SourceLocation {
  int line = 0, column = 0;
};

class Problems {
 public:
  // The same problem at the same location counts once.
  void add(const std::filesystem::path& file, SourceLocation location, std::string what);
  std::size_t count() const { return problems_.size(); }

  // Throws ConfigError where there are any: files in the order in which they were first named, each
  // by line and column.
  void throw_if_any() const;

 private:
  std::vector<ConfigProblem> problems_;
};

}  // namespace fivepipe::config
