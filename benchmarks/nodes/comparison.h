// Two results of one benchmark, side by side. Pure.
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace fivepipe::node_bench {

struct ComparedResult {
  std::string name;
  double before_ms = 0, after_ms = 0;  // medians
  double ratio() const { return after_ms / before_ms; }
  bool is_slower_than(double max_ratio) const {
    return !(ratio() <= max_ratio) || !(after_ms > 0);
  }                                       // nothing measured is no good result
  bool output_differs = false;            // both have a checksum, and not the same
  std::vector<std::string> worse_errors;  // "max_mm: 0.2 instead of 0.1"
};
struct Comparison {
  std::vector<ComparedResult> results;  // in the order of the first
  std::vector<std::string> only_before, only_after;
  std::string machines;  // empty: the same; otherwise how they differ
};
// Both as `fivepipe bench --json` writes them. Throws std::runtime_error saying what is missing, of
// which.
Comparison compared(const nlohmann::json& before, const nlohmann::json& after);

}  // namespace fivepipe::node_bench
