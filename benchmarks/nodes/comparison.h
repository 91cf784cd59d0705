// Compares two result files of one benchmark. Pure.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace fivepipe::node_bench {

struct ComparedResult {
  std::string name;
  double before_ms = 0, after_ms = 0;  // medians
  double ratio() const { return after_ms / before_ms; }
  // Returns true if the ratio exceeds max_ratio, and if a median is NaN or has become 0, because
  // such a result measured nothing. A stage may take 0 ms in both files.
  bool is_slower_than(double max_ratio) const {
    return !(after_ms <= max_ratio * before_ms) || (before_ms > 0 && !(after_ms > 0));
  }
  bool output_differs = false;            // both have a checksum, and the checksums differ
  std::vector<std::string> worse_errors;  // "max_mm: 0.2 instead of 0.1"
};
struct Comparison {
  std::vector<ComparedResult> results;  // in the order of `before`
  std::vector<std::string> only_before, only_after;
  std::string machines;  // both machines if they differ, else empty
};
// Takes two files as `fivepipe bench --json` writes them. Throws std::runtime_error that names the
// file and what it lacks.
Comparison compared(const nlohmann::json& before, const nlohmann::json& after);

}  // namespace fivepipe::node_bench
