// The part of `bench capture` about sub-pixel silhouettes.
#pragma once
#include <nlohmann/json.hpp>

namespace fivepipe::capture_bench {

// Measures the shipped rigs of four and of six cameras, prints a table of each, and returns the
// results for the JSON file. quick: one pose and one run.
nlohmann::ordered_json report_coverage(bool quick);

}  // namespace fivepipe::capture_bench
