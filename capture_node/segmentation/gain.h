// Changes of brightness of the whole image: exposure, gain, white balance and flicker of the light
// multiply each channel by a number.
#pragma once
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

namespace fivepipe::capture {

using Bgr = std::array<std::uint8_t, 3>;
using Levels = std::array<float, 3>;  // b, g, r
using Gain = std::array<double, 3>;   // of the channels b, g, r; 1: as learned

// About kGainSamples positions, spread evenly over the image, inside it.
std::vector<cv::Point> gain_grid(int width_px, int height_px);
inline constexpr int kGainSamples = 1024;

// Estimates by how much an image is brighter than its background. The most frequent ratio of the
// levels decides, because objects and shadows change it in other ways; then the samples near it are
// averaged.
class GainEstimator {
 public:
  // background: levels at `positions`. Ignores levels that are too dark for a ratio, or so bright
  // that they saturate.
  GainEstimator(std::span<const cv::Point> positions, std::span<const Levels> background);

  // image_bgr: 8-bit BGR. Returns 1 for a channel unless at least a fifth of its samples, and
  // kMinSamples of them, agree on a ratio from 1/kMaxGain to kMaxGain.
  Gain gain(const cv::Mat& image_bgr) const;

  static constexpr double kMaxGain = 1.5;
  static constexpr int kMinSamples = 64;

 private:
  struct Samples {
    std::vector<cv::Point> positions;
    std::vector<std::uint16_t> levels;  // of the background, fixed-point
    std::vector<int> bins_per_level;    // of the histogram of ratios, fixed-point
  };
  static int most_frequent_ratio(std::span<const std::uint16_t> levels, const Samples& samples);

  std::array<Samples, 3> samples_;  // by channel
};

// Returns the gain with 1 for each channel in which it moves no level by more than half of one.
Gain visible(const Gain& gain);

// Fixed-point factors 1 / gain of the channels, in units of 1 / kInverseOne.
using InverseGain = std::array<std::uint16_t, 3>;
InverseGain inverse_of(const Gain& gain);
inline constexpr std::uint16_t kInverseOne = 4096;
inline constexpr InverseGain kNoGain = {kInverseOne, kInverseOne, kInverseOne};
// Returns the level that the background's brightness would have given: level / gain, rounded.
std::uint8_t compensated(std::uint8_t level, std::uint16_t inverse_gain);

// Compensated levels of all levels, by channel.
using GainTables = std::array<std::array<std::uint8_t, 256>, 3>;
GainTables compensating_tables(const Gain& gain);
// Compensates interleaved pixels; to.size() is a multiple of 3.
void apply(const GainTables& tables, const std::uint8_t* from_bgr, std::span<std::uint8_t> to_bgr);

}  // namespace fivepipe::capture
