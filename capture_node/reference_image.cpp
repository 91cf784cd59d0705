#include "capture_node/reference_image.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace fivepipe {
namespace {

constexpr double kSigmaOfMedianDeviation = 1.4826;  // of a normal distribution

struct MeanSigma {
  float mean, sigma;
};

// Reorders the samples.
MeanSigma trimmed(std::vector<std::uint8_t>& samples, std::vector<std::uint8_t>& deviations) {
  const auto middle = std::ptrdiff_t(samples.size() / 2);
  std::nth_element(samples.begin(), samples.begin() + middle, samples.end());
  const int median = samples[std::size_t(middle)];
  for (std::size_t i = 0; i < samples.size(); ++i) deviations[i] = std::uint8_t(std::abs(samples[i] - median));
  std::nth_element(deviations.begin(), deviations.begin() + middle, deviations.end());
  const int reach = int(std::max(kTrimFloorLevels, kTrimSigmas * kSigmaOfMedianDeviation * deviations[std::size_t(middle)]));
  int n = 0, sum = 0, squares = 0;  // about the median
  for (const int sample : samples)
    if (const int d = sample - median; std::abs(d) <= reach) {
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
  ReferenceImage reference{width, height, {}, {}};
  const std::size_t row_bytes = std::size_t(width) * 3;
  reference.mean_levels.resize(row_bytes * height);
  reference.sigma_levels.resize(row_bytes * height);
  std::vector<std::uint8_t> samples(empty_frames.size()), deviations(empty_frames.size());
  std::vector<const std::uint8_t*> rows(empty_frames.size());
  for (int v = 0; v < height; ++v) {
    for (std::size_t f = 0; f < rows.size(); ++f) {
      assert(empty_frames[f].type() == CV_8UC3 && empty_frames[f].cols == width && empty_frames[f].rows == height);
      rows[f] = empty_frames[f].ptr(v);
    }
    for (std::size_t i = 0; i < row_bytes; ++i) {
      for (std::size_t f = 0; f < rows.size(); ++f) samples[f] = rows[f][i];
      const MeanSigma value = trimmed(samples, deviations);
      reference.mean_levels[v * row_bytes + i] = value.mean;
      reference.sigma_levels[v * row_bytes + i] =
          int(empty_frames.size()) < kFewestForNoise ? float(kPlateSigmaLevels) : value.sigma;
    }
  }
  return reference;
}

ReferenceImage reference_from_plate(const cv::Mat& plate) { return learn_reference({&plate, 1}); }

}  // namespace fivepipe
