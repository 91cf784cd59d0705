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
    const auto level = [](double x) { return std::uint8_t(std::clamp(std::floor(x), 0.0, 255.0)); };
    tables.mean[word][3 * lane + c] = level(mean + 0.5);
    const std::uint8_t of_level = level(tolerance);
    tables.tolerances[word][3 * lane + c] = of_level;
    tables.tolerance[word] = std::min(tables.tolerance[word], of_level);
  }
  tables.strong_excess[word][lane] =
      std::uint8_t(std::clamp(std::floor((tolerances.strong_factor - 1) * widest), 0.0, 255.0));
}

int word_of(const DifferenceTables& tables, const MovingPixel& pixel) {
  return pixel.index / tables.width_px * tables.words_per_row + pixel.index % tables.width_px / 64;
}

// Fills the boxes of the moving pixels of row v. brighter: as in refill_row().
void fill_boxes(DifferenceTables& tables, const Background& background, int v,
                const Gain& brighter) {
  const auto is_before = [](const MovingPixel& pixel, int index) { return pixel.index < index; };
  auto pixel = std::lower_bound(background.moving.begin(), background.moving.end(),
                                v * tables.width_px, is_before);
  auto moving = std::lower_bound(
      tables.moving.begin(), tables.moving.end(), v * tables.words_per_row,
      [](const DifferenceTables::MovingWord& of, int word) { return of.word < word; });
  for (; pixel != background.moving.end() && pixel->index / tables.width_px == v; ++pixel) {
    while (moving->word != word_of(tables, *pixel)) ++moving;
    const auto lane = std::size_t(pixel->index % tables.width_px % 64);
    for (std::size_t i = 0; i < pixel->boxes.size(); ++i)
      for (std::size_t c = 0; c < 3; ++c) {
        const double low = std::floor(pixel->boxes[i].low[c] * brighter[c]),
                     high = std::ceil(pixel->boxes[i].high[c] * brighter[c]);
        moving->boxes[i].low[c][lane] = std::uint8_t(std::min(255.0, low));
        moving->boxes[i].high[c][lane] = std::uint8_t(std::min(255.0, high));
      }
  }
}

}  // namespace

DifferenceTables difference_tables(const Background& background, const Tolerances& tolerances) {
  DifferenceTables tables;
  tables.width_px = background.width_px;
  tables.height_px = background.height_px;
  tables.words_per_row = (background.width_px + 63) / 64;
  const std::size_t words = std::size_t(tables.words_per_row) * tables.height_px;
  tables.mean.assign(words, {});
  tables.tolerance.assign(words, 255);
  WordLevels any{};
  any.fill(255);
  tables.tolerances.assign(words, any);  // pixels beyond the row
  tables.strong_excess.assign(words, {});
  LevelPlanes never{};
  for (auto& plane : never) plane.fill(255);
  for (const MovingPixel& pixel : background.moving) {
    const int word = word_of(tables, pixel);
    if (tables.moving.empty() || tables.moving.back().word != word)
      tables.moving.push_back({word, {}});
    auto& boxes = tables.moving.back().boxes;
    while (boxes.size() < pixel.boxes.size()) boxes.push_back({never, LevelPlanes{}});
  }
  for (int v = 0; v < tables.height_px; ++v)
    refill_row(tables, background, tolerances, v, {1, 1, 1});
  return tables;
}

void refill_row(DifferenceTables& tables, const Background& background,
                const Tolerances& tolerances, int v, const Gain& brighter) {
  std::fill_n(tables.tolerance.begin() + std::ptrdiff_t(v) * tables.words_per_row,
              tables.words_per_row, std::uint8_t(255));
  for (int u = 0; u < tables.width_px; ++u) fill(tables, background, tolerances, u, v);
  fill_boxes(tables, background, v, brighter);
}

}  // namespace fivepipe::capture
