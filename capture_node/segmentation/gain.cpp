#include "capture_node/segmentation/gain.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace fivepipe::capture {
namespace {

// Levels below give a coarse ratio, levels above saturate if the image becomes brighter.
constexpr int kMinLevel = 30, kMaxLevel = 235;
// A level of the image that may be saturated.
constexpr int kSaturated = 250;
// The histogram of ratios, with `kBinsPerUnit` bins per 1.
constexpr int kBinsPerUnit = 64, kBins = 2 * kBinsPerUnit;
// Samples within this of the most frequent ratio are averaged: four deviations of ordinary noise.
constexpr int kNear_levels = 8;
// Ratios have the unit 1 / kOne, levels of the background 1 / kBackgroundLevel. The upper half of
// their 32-bit product is a level with the unit 1 / kLevel, so that the compiler finds 16-bit
// instructions for it.
constexpr int kOne = 1 << 14, kBackgroundLevel = 1 << 6, kLevel = 1 << 4;
static_assert(kOne * kBackgroundLevel == kLevel << 16);
constexpr int kReciprocalBits = 20;
// A smaller change moves no level by more than half of one.
constexpr double kInvisible = 1.0 / 512;
// Fraction of the samples that must agree.
constexpr double kMinAgreeing = 0.2;

}  // namespace

std::vector<cv::Point> gain_grid(int width_px, int height_px) {
  const double step = std::max(1.0, std::sqrt(double(width_px) * height_px / kGainSamples));
  std::vector<cv::Point> grid;
  for (double v = step / 2; v < height_px; v += step)
    for (double u = step / 2; u < width_px; u += step) grid.emplace_back(int(u), int(v));
  return grid;
}

GainEstimator::GainEstimator(std::span<const cv::Point> positions,
                             std::span<const Levels> background) {
  assert(positions.size() == background.size());
  for (std::size_t i = 0; i < positions.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) {
      if (background[i][c] >= kMinLevel && background[i][c] <= kMaxLevel) {
        samples_[c].positions.push_back(positions[i]);
        samples_[c].levels.push_back(
            std::uint16_t(std::lround(kBackgroundLevel * background[i][c])));
        samples_[c].bins_per_level.push_back(
            int(float(kBinsPerUnit << kReciprocalBits) / background[i][c]));
      }
    }
}

// Returns the most frequent ratio of levels, in units of 1 / kOne.
int GainEstimator::most_frequent_ratio(std::span<const std::uint16_t> levels,
                                       const Samples& samples) {
  // Most samples have the same ratio. Two histograms keep one increment from waiting for the last.
  std::array<std::array<int, kBins>, 2> histograms{};
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const int bin = levels[i] * samples.bins_per_level[i] >> kReciprocalBits;
    if (levels[i] < kSaturated && bin < kBins) ++histograms[i % 2][std::size_t(bin)];
  }
  std::array<int, kBins> histogram;
  for (std::size_t b = 0; b < kBins; ++b) histogram[b] = histograms[0][b] + histograms[1][b];
  // Three neighbouring bins, because a ratio near a limit divides its samples.
  int best = 0, most = -1;
  for (int bin = 1; bin + 1 < kBins; ++bin) {
    const auto b = std::size_t(bin);
    const int count = histogram[b - 1] + 2 * histogram[b] + histogram[b + 1];
    if (count > most) best = bin, most = count;
  }
  return (2 * best + 1) * kOne / (2 * kBinsPerUnit);
}

Gain GainEstimator::gain(const cv::Mat& image_bgr) const {
  Gain result{1, 1, 1};
  std::vector<std::uint16_t> levels;
  for (std::size_t c = 0; c < 3; ++c) {
    const Samples& samples = samples_[c];
    const std::size_t count = samples.positions.size();
    levels.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      const cv::Point& at = samples.positions[i];
      levels[i] = image_bgr.ptr(at.y)[3 * at.x + int(c)];
    }
    auto ratio = std::uint16_t(most_frequent_ratio(levels, samples));
    int sum = 0, background_sum = 0, agreeing = 0;
    for (int pass = 0; pass < 2; ++pass) {
      sum = background_sum = agreeing = 0;
      for (std::size_t i = 0; i < count; ++i) {
        const auto level = std::int16_t(levels[i]), background = std::int16_t(samples.levels[i]);
        const auto expected = std::int16_t((unsigned(ratio) * samples.levels[i]) >> 16);
        const auto away = std::int16_t(kLevel * level - expected);
        const auto is_near = std::int16_t((level < kSaturated) & (away < kNear_levels * kLevel) &
                                          (away > -kNear_levels * kLevel));
        sum += is_near * level;
        background_sum += is_near * background;
        agreeing += is_near;
      }
      if (background_sum > 0)
        ratio = std::uint16_t(std::min<long>(
            std::lround(double(kOne) * kBackgroundLevel * sum / background_sum), 0xffff));
    }
    if (agreeing < kMinSamples || agreeing < kMinAgreeing * double(count)) continue;
    const double gain = double(kBackgroundLevel) * sum / background_sum;
    if (gain > kMaxGain || gain * kMaxGain < 1) continue;
    result[c] = gain;
  }
  return result;
}

Gain visible(const Gain& gain) {
  Gain result = gain;
  for (double& channel : result)
    if (std::abs(channel - 1) < kInvisible) channel = 1;
  return result;
}

InverseGain inverse_of(const Gain& gain) {
  InverseGain inverse;
  for (std::size_t c = 0; c < 3; ++c)
    inverse[c] = std::uint16_t(std::lround(kInverseOne / gain[c]));
  return inverse;
}

std::uint8_t compensated(std::uint8_t level, std::uint16_t inverse_gain) {
  // Sixteen times the quotient, rounded down as the SIMD code does it.
  const unsigned sixteenfold = unsigned(level) * 256 * inverse_gain >> 16;
  return std::uint8_t(std::min(255u, (sixteenfold + 8) >> 4));
}

GainTables compensating_tables(const Gain& gain) {
  const InverseGain inverse = inverse_of(gain);
  GainTables tables;
  for (std::size_t c = 0; c < 3; ++c)
    for (int level = 0; level < 256; ++level)
      tables[c][std::size_t(level)] = compensated(std::uint8_t(level), inverse[c]);
  return tables;
}

void apply(const GainTables& tables, const std::uint8_t* from_bgr, std::span<std::uint8_t> to_bgr) {
  for (std::size_t i = 0; i < to_bgr.size(); i += 3)
    for (std::size_t c = 0; c < 3; ++c) to_bgr[i + c] = tables[c][from_bgr[i + c]];
}

}  // namespace fivepipe::capture
