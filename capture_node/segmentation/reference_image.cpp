#include "capture_node/segmentation/reference_image.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

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

}  // namespace

ReferenceImage learn_reference(std::span<const cv::Mat> empty_frames) {
  assert(!empty_frames.empty());
  const int width = empty_frames[0].cols, height = empty_frames[0].rows;
  const std::size_t row_bytes = std::size_t(width) * 3, median_index = empty_frames.size() / 2;
  const bool measures_noise = int(empty_frames.size()) >= kMinFramesForNoise;
  ReferenceImage reference{width, height, std::vector<float>(row_bytes * height),
                           std::vector<float>(row_bytes * height)};
  std::vector<Row> samples(empty_frames.size()), deviations(empty_frames.size());
  for (int v = 0; v < height; ++v) {
    for (std::size_t f = 0; f < samples.size(); ++f) {
      assert(empty_frames[f].type() == CV_8UC3 && empty_frames[f].cols == width &&
             empty_frames[f].rows == height);
      samples[f].assign(empty_frames[f].ptr(v), empty_frames[f].ptr(v) + row_bytes);
    }
    sort_elements(samples);
    const Row& median = samples[median_index];
    for (std::size_t f = 0; f < samples.size(); ++f) {
      deviations[f].resize(row_bytes);
      for (std::size_t k = 0; k < row_bytes; ++k)
        deviations[f][k] = std::uint8_t(std::abs(samples[f][k] - median[k]));
    }
    sort_elements(deviations);
    for (std::size_t k = 0; k < row_bytes; ++k) {
      const double max_deviation = std::max(
          kTrimFloor_levels, kTrim_sigmas * kSigmaOfMedianDeviation * deviations[median_index][k]);
      const MeanSigma value = trimmed(samples, k, median[k], int(max_deviation));
      reference.mean_levels[v * row_bytes + k] = value.mean;
      reference.sigma_levels[v * row_bytes + k] =
          measures_noise ? value.sigma : float(kPlateSigma_levels);
    }
  }
  return reference;
}

}  // namespace fivepipe::capture
