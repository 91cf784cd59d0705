#include "capture_node/segmentation/background.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

#include "capture_node/segmentation/gain.h"

namespace fivepipe::capture {
namespace {

// Ratio of the standard deviation to the median absolute deviation of a normal distribution.
constexpr double kSigmaOfMedianDeviation = 1.4826;

using Row = std::vector<std::uint8_t>;

// Uses values instead of std::min's references, because only then does the compiler vectorise.
void exchange_elements(std::uint8_t* __restrict low, std::uint8_t* __restrict high, std::size_t n) {
  for (std::size_t k = 0; k < n; ++k) {
    const std::uint8_t a = low[k], b = high[k];
    low[k] = a < b ? a : b;
    high[k] = a < b ? b : a;
  }
}

// Sorts rows[0..n) element by element, so that rows[0] holds each element's minimum. Batcher's
// merge exchange (Knuth, The Art of Computer Programming 3, 5.2.2, algorithm M): its sequence of
// comparisons does not depend on the data, so it can compare whole rows at a time.
void sort_elements(std::vector<Row>& rows) {
  const std::size_t n = rows.size();
  const auto exchange = [&](std::size_t i, std::size_t j) {
    exchange_elements(rows[i].data(), rows[j].data(), rows[i].size());
  };
  const std::size_t top = n > 1 ? std::bit_ceil(n) / 2 : 0;
  for (std::size_t p = top; p > 0; p /= 2) {
    std::size_t q = top, r = 0, d = p;
    for (;;) {
      for (std::size_t i = 0; i + d < n; ++i)
        if ((i & p) == r) exchange(i, i + d);
      if (q == p) break;
      d = q - p;
      q /= 2;
      r = p;
    }
  }
}

struct MeanSigma {
  float mean, sigma;
};

// Returns mean and standard deviation of those samples of element k that are within `max_deviation`
// of the median.
MeanSigma trimmed(const std::vector<Row>& samples, std::size_t k, int median, int max_deviation) {
  int n = 0, sum = 0, squares = 0;  // relative to the median
  for (const Row& row : samples)
    if (const int d = row[k] - median; std::abs(d) <= max_deviation) {
      ++n;
      sum += d;
      squares += d * d;
    }
  const double mean = double(sum) / n;
  const double variance = n > 1 ? std::max(0.0, (squares - sum * mean) / (n - 1)) : 0.0;
  return {float(median + mean), float(std::sqrt(variance))};
}

// The tables that bring each frame to the brightness of the median.
std::vector<GainTables> gains_of(std::span<const cv::Mat> frames, bool compensates) {
  std::vector<GainTables> tables;
  if (!compensates || frames.size() == 1) {
    tables.assign(frames.size(), compensating_tables({1, 1, 1}));
    return tables;
  }
  const std::vector<cv::Point> grid = gain_grid(frames[0].cols, frames[0].rows);
  std::vector<Levels> median;
  for (const cv::Point& at : grid) {
    Levels of_pixel{};
    for (std::size_t c = 0; c < 3; ++c) {
      std::vector<std::uint8_t> levels;
      for (const cv::Mat& frame : frames) levels.push_back(frame.ptr(at.y)[3 * at.x + int(c)]);
      std::nth_element(levels.begin(), levels.begin() + std::ptrdiff_t(levels.size() / 2),
                       levels.end());
      of_pixel[c] = levels[levels.size() / 2];
    }
    median.push_back(of_pixel);
  }
  const GainEstimator estimator(grid, median);
  for (const cv::Mat& frame : frames)
    tables.push_back(compensating_tables(visible(estimator.gain(frame))));
  return tables;
}

// The samples of one pixel, in the order of the frames.
struct Samples {
  const std::vector<Row>& rows;
  std::size_t u;
  std::uint8_t level(std::size_t frame, std::size_t channel) const {
    return rows[frame][3 * u + channel];
  }
};

// Returns true if the samples beyond `max_deviation_levels` of the mean return again and again.
bool is_moving(const Samples& samples, const float* mean, double max_deviation_levels) {
  const std::size_t n = samples.rows.size();
  std::size_t away = 0, runs = 0;
  bool before = false;
  for (std::size_t f = 0; f < n; ++f) {
    bool is_away = false;
    for (std::size_t c = 0; c < 3; ++c)
      is_away |= std::abs(float(samples.level(f, c)) - mean[c]) > float(max_deviation_levels);
    away += is_away;
    runs += is_away && !before;
    before = is_away;
  }
  return double(away) >= kMovingFraction * double(n) &&
         double(runs) >= std::max(kMinMovingRuns, kMovingRunsPerFrame * double(n));
}

// Divides the samples by equal parts of the range of the channel that varies most. Neighbouring
// parts overlap by the margin.
std::vector<ColourBox> boxes_of(const Samples& samples, int count) {
  const std::size_t n = samples.rows.size();
  std::size_t axis = 0;
  int low = 0, range = -1;
  for (std::size_t c = 0; c < 3; ++c) {
    int least = 255, most = 0;
    for (std::size_t f = 0; f < n; ++f) {
      least = std::min<int>(least, samples.level(f, c));
      most = std::max<int>(most, samples.level(f, c));
    }
    if (most - least > range) axis = c, low = least, range = most - least;
  }
  std::vector<ColourBox> boxes;
  for (int part = 0; part < count; ++part) {
    const int from = low + range * part / count - kMovingMargin_levels,
              to = low + range * (part + 1) / count + kMovingMargin_levels;
    std::array<int, 3> least{255, 255, 255}, most{};
    bool any = false;
    for (std::size_t f = 0; f < n; ++f) {
      if (samples.level(f, axis) < from || samples.level(f, axis) > to) continue;
      any = true;
      for (std::size_t c = 0; c < 3; ++c) {
        least[c] = std::min<int>(least[c], samples.level(f, c));
        most[c] = std::max<int>(most[c], samples.level(f, c));
      }
    }
    if (!any) continue;
    ColourBox& box = boxes.emplace_back();
    for (std::size_t c = 0; c < 3; ++c) {
      box.low[c] = std::uint8_t(std::max(0, least[c] - kMovingMargin_levels));
      box.high[c] = std::uint8_t(std::min(255, most[c] + kMovingMargin_levels));
    }
  }
  return boxes;
}

}  // namespace

Background learn_background(std::span<const cv::Mat> empty_frames,
                            const LearningSettings& settings) {
  assert(!empty_frames.empty() && empty_frames.size() <= std::size_t(config::kMaxLearningImages));
  const int width = empty_frames[0].cols, height = empty_frames[0].rows;
  for ([[maybe_unused]] const cv::Mat& frame : empty_frames)
    assert(frame.type() == CV_8UC3 && frame.cols == width && frame.rows == height);
  const std::size_t n = empty_frames.size(), row_bytes = std::size_t(width) * 3,
                    median_index = n / 2;
  const bool measures_noise = int(n) >= kMinFramesForNoise;
  const std::vector<GainTables> gains = gains_of(empty_frames, settings.compensates_gain);
  Background background{width,
                        height,
                        std::vector<float>(row_bytes * std::size_t(height)),
                        std::vector<float>(row_bytes * std::size_t(height)),
                        {}};
  std::vector<Row> samples(n), sorted(n), deviations(n, Row(row_bytes));
  for (int v = 0; v < height; ++v) {
    for (std::size_t f = 0; f < n; ++f) {
      samples[f].resize(row_bytes);
      apply(gains[f], empty_frames[f].ptr(v), samples[f]);
    }
    sorted = samples;
    sort_elements(sorted);
    const Row& median = sorted[median_index];
    for (std::size_t f = 0; f < n; ++f)
      for (std::size_t k = 0; k < row_bytes; ++k)
        deviations[f][k] = std::uint8_t(std::abs(sorted[f][k] - median[k]));
    sort_elements(deviations);
    float* const mean = background.mean_levels.data() + std::size_t(v) * row_bytes;
    float* const sigma = background.sigma_levels.data() + std::size_t(v) * row_bytes;
    for (std::size_t k = 0; k < row_bytes; ++k) {
      const double max_deviation = std::max(
          kTrimFloor_levels, kTrim_sigmas * kSigmaOfMedianDeviation * deviations[median_index][k]);
      const MeanSigma value = trimmed(sorted, k, median[k], int(max_deviation));
      mean[k] = value.mean;
      sigma[k] = measures_noise ? value.sigma : float(kPlateSigma_levels);
    }
    if (settings.moving_boxes <= 0 || !measures_noise) continue;
    for (std::size_t u = 0; u < std::size_t(width); ++u) {
      const Samples of_pixel{samples, u};
      bool varies = false;  // most pixels do not, and need no second look
      for (std::size_t k = 3 * u; k < 3 * u + 3; ++k)
        varies |= float(sorted[n - 1][k]) - mean[k] > float(settings.max_noise_levels) ||
                  mean[k] - float(sorted[0][k]) > float(settings.max_noise_levels);
      if (varies && is_moving(of_pixel, mean + 3 * u, settings.max_noise_levels))
        background.moving.push_back(
            {v * width + int(u), boxes_of(of_pixel, settings.moving_boxes)});
    }
  }
  return background;
}

}  // namespace fivepipe::capture
