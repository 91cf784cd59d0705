// The hull benchmark's results as a table, as JSON and as plots.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "benchmarks/hull/every_pixel.h"
#include "benchmarks/hull/truth.h"

namespace fivepipe::hull_bench {

struct Result {
  std::string method, scene;
  int width_px = 0, height_px = 0, threads = 0, cameras = 0;
  std::vector<double> time_ms;  // per run
  Errors errors;
  std::optional<PixelErrors> pixels;        // if every pixel was compared with the reference
  int hits = 0;                             // pixels of the view with hull
  std::uint64_t checksum = 0;               // of the depths
  double maps_covered = 0;                  // fraction of the maps that are object pixels
  double footprint_mm = 0;                  // width of a map pixel at the object
  int map_width_px = 0, map_height_px = 0;  // of the first camera
  std::string name() const;                 // "cpu/hand4/640x480/2"
};

std::uint64_t checksum(std::span<const float> depths);  // FNV-1a over the bits

void print(const std::vector<Result>& results);  // to stdout
void print_every_pixel(const std::vector<Result>& results);
// Prints for each view the time of every baseline relative to backend cpu, at the baseline's
// fastest setting with a mean error of at most kFairError_mm.
void print_ratios(const std::vector<Result>& results);
inline constexpr double kFairError_mm = 2;

// Throws std::runtime_error if the file cannot be written.
void write_json(const std::filesystem::path& file, const std::vector<Result>& results,
                const std::string& gl_renderer);

// Entries SCENE/WIDTHxHEIGHT/BACKEND of suite `hull_every_pixel`. Throws as write_json().
void write_every_pixel_json(const std::filesystem::path& file, const std::vector<PixelRow>& rows,
                            const std::string& gl_renderer);

// Plots time against error, and time against the number of cameras, the view's size and its
// coverage. File, result and errors as for bench::Plots::draw().
bool plot(const std::vector<Result>& results, const std::filesystem::path& file);

}  // namespace fivepipe::hull_bench
