// The part of `bench capture` about the steps of segmentation: what each of them costs in true
// object pixels, and what it removes.
#pragma once
#include <nlohmann/json.hpp>

#include "benchmarks/capture/sequences.h"
#include "common/config/capture/capture_config.h"

namespace fivepipe::capture_bench {

// Pixels of a sequence, per image.
struct PixelErrors {
  double missed_fraction = 0;  // of the true object pixels
  double false_px = 0;         // found, but not true
};
PixelErrors errors_of(const config::SegmentationConfig& config, const Sequence& sequence);

// Segments one sequence of each disturbance, of this size, with the defaults, and with each step
// skipped or made stronger; prints a table, and returns the results for the JSON file.
nlohmann::ordered_json report_steps(int width_px, int height_px, int threads);

}  // namespace fivepipe::capture_bench
