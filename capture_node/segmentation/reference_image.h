// What a camera sees while the scene is empty (paper, section 3.1: the reference image), with its
// noise.
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

// From frames of the empty scene, all 8-bit BGR of one size, at least one. Median first, then mean
// and deviation of the samples near it: someone crossing a minority of the frames leaves no trace.
// Fewer than kMinFramesForNoise frames: the noise is kPlateSigma_levels.
ReferenceImage learn_reference(std::span<const cv::Mat> empty_frames);

// From a single picture of the empty scene: no noise can be measured, kPlateSigma_levels is
// assumed.
ReferenceImage reference_from_plate(const cv::Mat& plate);

inline constexpr int kMinFramesForNoise = 8;  // below, a deviation is off by more than a quarter
inline constexpr double kPlateSigma_levels = 2.0;  // noise of an ordinary camera in room light
inline constexpr double kTrim_sigmas =
    4.0;  // samples farther from the median than this are not the empty scene
inline constexpr double kTrimFloor_levels =
    4.0;  // 8-bit rounding makes the median deviation of quiet pixels zero

}  // namespace fivepipe::capture
