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
  // Adds the options. The app must not outlive this object. Without a recording, the options that
  // select messages of it are refused.
  BenchOptions(CLI::App& app, bool needs_recording);
  node_bench::FromRecordingOptions values() const;  // after parsing

 private:
  node_bench::FromRecordingOptions options_;
  std::vector<std::string> settings_;
  std::string rate_ = "max";
};

// Parses the words. Returns nullopt, or the exit code after help or an error has been printed.
std::optional<int> parse(CLI::App& app, const std::vector<std::string>& words);

}  // namespace fivepipe::measure
