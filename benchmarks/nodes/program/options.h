// The options that `fivepipe bench NODE` and `fivepipe bench pipeline` share.
#pragma once
#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "benchmarks/nodes/from_recording.h"

namespace fivepipe::measure {

class BenchOptions {
 public:
  explicit BenchOptions(CLI::App& app);  // adds the options; the app must not outlive this object
  node_bench::FromRecordingOptions values() const;  // after parsing

 private:
  node_bench::FromRecordingOptions options_;
  std::vector<std::string> settings_;
  std::string rate_ = "max";
};

// Parses the words. Returns nullopt, or the exit code after help or an error has been printed.
std::optional<int> parse(CLI::App& app, const std::vector<std::string>& words);

}  // namespace fivepipe::measure
