// The reference image (paper, section 3.1): a camera's image of the empty scene, and the noise of
// each pixel.
#pragma once
#include <opencv2/core.hpp>
#include <span>
#include <vector>

namespace fivepipe::capture {

// Per pixel and channel, interleaved BGR, row-major; grey levels of 255.
struct ReferenceImage {
  int width_px = 0, height_px = 0;
  std::vector<float> mean_levels, sigma_levels;
};

// Learns the reference from at least one frame of the empty scene, all 8-bit BGR of one size
// (asserted). Takes the median first, then mean and deviation of the samples near it, so that a
// person who crosses the scene in a minority of the frames has no effect. With fewer than
// kMinFramesForNoise frames the noise is kPlateSigma_levels.
ReferenceImage learn_reference(std::span<const cv::Mat> empty_frames);

// Fewer samples give a standard deviation with an error above a quarter.
inline constexpr int kMinFramesForNoise = 8;
// Noise of an ordinary camera in room light.
inline constexpr double kPlateSigma_levels = 2.0;
// Samples farther from the median than this do not show the empty scene.
inline constexpr double kTrim_sigmas = 4.0;
// Lower bound of that distance: 8-bit rounding makes the median deviation of quiet pixels zero.
inline constexpr double kTrimFloor_levels = 4.0;

}  // namespace fivepipe::capture
