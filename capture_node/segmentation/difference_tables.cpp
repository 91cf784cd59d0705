#include <algorithm>
#include <cassert>
#include <cmath>

#include "capture_node/segmentation/difference.h"

namespace fivepipe::capture {
namespace {

// Half the range of the means in the 3x3 neighbourhood, of channel c.
double gradient(const Background& background, int u, int v, int c) {
  float least = 255, most = 0;
  for (int y = std::max(0, v - 1); y <= std::min(background.height_px - 1, v + 1); ++y)
    for (int x = std::max(0, u - 1); x <= std::min(background.width_px - 1, u + 1); ++x) {
      const float level =
          background.mean_levels[3 * (std::size_t(y) * background.width_px + x) + c];
      least = std::min(least, level);
      most = std::max(most, level);
    }
  return 0.5 * (most - least);
}

// Fills the tables of pixel (u, v).
void fill(DifferenceTables& tables, const Background& background, const Tolerances& tolerances,
          int u, int v) {
  const std::size_t word = std::size_t(v) * tables.words_per_row + u / 64, lane = u % 64;
  double widest = 0;
  for (int c = 0; c < 3; ++c) {
    const std::size_t k = 3 * (std::size_t(v) * background.width_px + u) + c;
    const double mean = background.mean_levels[k];
    double tolerance = std::max(tolerances.floor_levels,
                                std::min(tolerances.ceiling_levels,
                                         tolerances.sigmas * double(background.sigma_levels[k])));
    if (tolerances.jitter_px > 0) tolerance += tolerances.jitter_px * gradient(background, u, v, c);
    widest = std::max(widest, tolerance);
    const auto level = [](double x) { return std::uint8_t(std::clamp(x, 0.0, 255.0)); };
    // The level nearest to the mean never differs.
    const std::uint8_t rounded = level(std::floor(mean + 0.5)),
                       low = std::min(rounded, level(std::ceil(mean - tolerance))),
                       high = std::max(rounded, level(std::floor(mean + tolerance)));
    tables.details[word].low[c][lane] = low;
    tables.details[word].high[c][lane] = high;
    tables.details[word].mean[c][lane] = tables.mean[word][3 * lane + c] = rounded;
    // Bounds at the end of the range exclude no level.
    std::uint8_t& of_level = tables.tolerances[word][3 * lane + c];
    of_level = 255;
    if (low > 0) of_level = std::min(of_level, std::uint8_t(rounded - low));
    if (high < 255) of_level = std::min(of_level, std::uint8_t(high - rounded));
    tables.tolerance[word] = std::min(tables.tolerance[word], of_level);
  }
  tables.details[word].strong_excess[lane] =
      std::uint8_t(std::clamp(std::floor((tolerances.strong_factor - 1) * widest), 0.0, 255.0));
}

}  // namespace

DifferenceTables difference_tables(const Background& background, const Tolerances& tolerances) {
  DifferenceTables tables;
  tables.width_px = background.width_px;
  tables.height_px = background.height_px;
  tables.words_per_row = (background.width_px + 63) / 64;
  DifferenceTables::Details beyond_row{};
  for (auto& plane : beyond_row.high) plane.fill(255);
  const std::size_t words = std::size_t(tables.words_per_row) * tables.height_px;
  tables.mean.assign(words, {});
  tables.tolerance.assign(words, 255);
  WordLevels any{};
  any.fill(255);
  tables.tolerances.assign(words, any);  // pixels beyond the row
  tables.details.assign(words, beyond_row);
  for (int v = 0; v < tables.height_px; ++v) refill_row(tables, background, tolerances, v);
  LevelPlanes never{};
  for (auto& plane : never) plane.fill(255);
  for (const MovingPixel& pixel : background.moving) {
    const int u = pixel.index % background.width_px, v = pixel.index / background.width_px;
    const int word = v * tables.words_per_row + u / 64;
    if (tables.moving.empty() || tables.moving.back().word != word)
      tables.moving.push_back({word, {}});
    auto& boxes = tables.moving.back().boxes;
    while (boxes.size() < pixel.boxes.size()) boxes.push_back({never, LevelPlanes{}});
    for (std::size_t i = 0; i < pixel.boxes.size(); ++i)
      for (std::size_t c = 0; c < 3; ++c) {
        boxes[i].low[c][u % 64] = pixel.boxes[i].low[c];
        boxes[i].high[c][u % 64] = pixel.boxes[i].high[c];
      }
  }
  return tables;
}

void refill_row(DifferenceTables& tables, const Background& background,
                const Tolerances& tolerances, int v) {
  std::fill_n(tables.tolerance.begin() + std::ptrdiff_t(v) * tables.words_per_row,
              tables.words_per_row, std::uint8_t(255));
  for (int u = 0; u < tables.width_px; ++u) fill(tables, background, tolerances, u, v);
}

}  // namespace fivepipe::capture
