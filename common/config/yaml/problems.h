// Collects the problems of all files that one load_deployment() reads, to report them together.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "common/config/yaml/config_error.h"

namespace fivepipe::config {

// Position in a text file; both count from 1; 0: no position.
struct SourceLocation {
  int line = 0, column = 0;
};

class Problems {
 public:
  // Adds a problem. Ignores the same text at the same location.
  void add(const std::filesystem::path& file, SourceLocation location, std::string what);
  std::size_t count() const { return problems_.size(); }

  // Throws ConfigError if there are problems: files in the order of their first problem, each
  // sorted by line and column.
  void throw_if_any() const;

 private:
  std::vector<ConfigProblem> problems_;
};

}  // namespace fivepipe::config
