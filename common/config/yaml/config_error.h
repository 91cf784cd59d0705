// The error that reports all problems of a set of configuration files together.
#pragma once
#include <stdexcept>
#include <string>
#include <vector>

namespace fivepipe::config {

// line and column count from 1; both are 0 if the problem has no location (a file that cannot be
// opened).
struct ConfigProblem {
  std::string file;
  int line = 0, column = 0;
  std::string what;
};

// what() lists every problem on its own line, as "file:line:column: what".
class ConfigError : public std::runtime_error {
 public:
  explicit ConfigError(std::vector<ConfigProblem> problems);
  const std::vector<ConfigProblem>& problems() const { return problems_; }

 private:
  std::vector<ConfigProblem> problems_;
};

}  // namespace fivepipe::config
