// The background: what a camera sees of the empty scene (the reference image of the paper,
// section 3.1), with the noise of each pixel.
#pragma once
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "common/config/capture/capture_config.h"

namespace fivepipe::capture {

// An interval of levels of each channel b, g, r.
struct ColourBox {
  std::array<std::uint8_t, 3> low, high;
};

// A pixel where the background moves, as leaves or a flag do: a level belongs to the background if
// one of the boxes holds it.
struct MovingPixel {
  int index;  // v * width_px + u
  std::vector<ColourBox> boxes;
};

// Per pixel and channel, interleaved BGR, row-major; grey levels of 255.
struct Background {
  int width_px = 0, height_px = 0;
  std::vector<float> mean_levels, sigma_levels;
  std::vector<MovingPixel> moving;  // by index
};

struct LearningSettings {
  // Brings all frames to the brightness of their median before their noise is measured.
  bool compensates_gain = true;
  // A sample farther than this from the mean shows a moving background or a foreground.
  double max_noise_levels = 16;
  // Boxes of a moving pixel; 0: no pixel is moving.
  int moving_boxes = 4;
};

// Learns the background from 1 to config::kMaxLearningImages frames of the empty scene, all 8-bit
// BGR of one size (asserted), in the order in which the camera took them. Takes the median first,
// then mean and deviation of the samples near it, so that a person who crosses the scene in a
// minority of the frames has no effect on them. With fewer than kMinFramesForNoise frames the noise
// is kPlateSigma_levels.
//
// A pixel is moving if the samples far from its mean return again and again (Kim, Chalidabhongse,
// Harwood, Davis 2005 demand the same of a codeword); a person who walks past covers it once. Its
// boxes divide the range of the channel that varies most, so that they follow the samples' curve
// through colour space instead of enclosing all of it. They enclose all samples of the pixel, also
// those of a person who walked past it.
Background learn_background(std::span<const cv::Mat> empty_frames,
                            const LearningSettings& settings = {});

// Fewer samples give a standard deviation with an error above a quarter.
inline constexpr int kMinFramesForNoise = 8;
// Noise of an ordinary camera in room light.
inline constexpr double kPlateSigma_levels = 2.0;
// Samples farther from the median than this do not show the empty scene.
inline constexpr double kTrim_sigmas = 4.0;
// Lower bound of that distance: 8-bit rounding makes the median deviation of quiet pixels zero.
inline constexpr double kTrimFloor_levels = 4.0;
// A moving pixel differs from its mean in at least this fraction of the frames,
inline constexpr double kMovingFraction = 0.1;
// in separate runs of frames whose number, divided by that of the frames, is at least this,
inline constexpr double kMovingRunsPerFrame = 1.0 / 12;
// and in at least this many runs. Two people who walk past make two.
inline constexpr double kMinMovingRuns = 3;
// Margin of the boxes beyond the samples. These rarely include the extremes.
inline constexpr int kMovingMargin_levels = 5;

}  // namespace fivepipe::capture
