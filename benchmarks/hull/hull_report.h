// The hull benchmark's results: as a table, as JSON, as plots.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "benchmarks/hull/truth.h"

namespace fivepipe::hull_bench {

struct Result {
  std::string method, scene;
  int width_px = 0, height_px = 0, threads = 0, cameras = 0;
  std::vector<double> time_ms;
  Errors errors;
  int hits = 0;
  std::uint64_t checksum = 0;
  double maps_covered = 0, footprint_mm = 0;
  std::string name() const;  // "cpu/hand4/640x480/2"
};

std::uint64_t checksum(std::span<const float> depths);

void print(const std::vector<Result>& results);
// What the best of ours gains over each rival's cheapest setting whose mean error is at most
// kFairError_mm, in each view.
void print_ratios(const std::vector<Result>& results);
inline constexpr double kFairError_mm = 2;

std::string json_of(const std::vector<Result>& results, const std::string& renderer);

// Speed against error, and cost against cameras, view size and coverage, by gnuplot: writes `file`
// (.png or .svg) and the script and numbers beside it. False where gnuplot is not there; the script
// can be run elsewhere. Throws std::runtime_error where files can't be written.
bool plot(const std::vector<Result>& results, const std::filesystem::path& file);

}  // namespace fivepipe::hull_bench
