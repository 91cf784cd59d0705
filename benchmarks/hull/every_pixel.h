// The depths of an exact backend against the independent reference, in every pixel of a view.
#pragma once
#include <array>
#include <span>
#include <string>
#include <vector>

#include "benchmarks/hull/scenes.h"
#include "common/base/worker_pool.h"

namespace fivepipe::hull_bench {

// Depths of backends `cpu` and `gl` differ from the reference by at most this fraction. Rounding to
// float is 6e-8.
inline constexpr double kMaxDepthError = 2e-6;

struct PixelErrors {
  std::size_t pixels = 0, hits = 0;  // of the view, and of the reference
  // Pixels that hit the hull in one result and miss it in the other, or whose depths differ by more
  // than kMaxDepthError.
  std::size_t wrong = 0;
  double max_depth_error = 0;  // relative, of the pixels that hit the hull in both results
};

// Returns the reference's depth [m] of every pixel of the view, row-major; 0 without a hull point.
std::vector<double> reference_depths_m(const HullScene& scene, const hull::View& view,
                                       base::WorkerPool& pool);
// Both spans have the pixels of one view. `depth_m` is as in hull::DepthTile.
PixelErrors compare_every_pixel(std::span<const float> depth_m,
                                std::span<const double> reference_m);

struct PixelRow {
  std::string scene, backend;
  int width_px, height_px;  // of the view
  PixelErrors errors;
};
// Scenes, and the sizes of their views [px].
struct Views {
  std::vector<HullScene> scenes;
  std::vector<std::array<int, 2>> sizes_px;
};
// Every scene of `fivepipe bench hull --full` at every size, without real maps.
std::vector<Views> all_views();

// Returns the rows as a table with a line of totals for each backend.
std::string every_pixel_table(std::span<const PixelRow> rows);

}  // namespace fivepipe::hull_bench
