// Image segmentation (paper, section 3.1): compares an image with the background of the empty scene
// and returns its object pixels. The steps:
//
//   1. Gain: estimates by how much the whole image is brighter, and removes it (gain.h).
//   2. Difference: the pixels whose levels are beyond the noise of their background, those that
//      differ strongly, and those that look like shadow (difference.h).
//   3. Majority: keeps the pixels that differ strongly, and those that differ together with a
//      majority of their neighbourhood.
//   4. Shadow: drops the pixels that look like shadow, unless at least kObjectNeighbours of their
//      neighbours differ without looking like it; beside these also the pixels with fewer than
//      kShadowNeighbours such pixels in their neighbourhood.
//   5. Opening; then hysteresis and areas: keeps connected regions of at least min_object_px pixels
//      with one that differs strongly (components.h).
//   6. Closing, and holes of at most max_hole_px pixels are filled.
//
// `conservative` skips steps 1 and 3 to 5, and in step 2 `jitter_px` and the colours of a moving
// background: all that can drop pixels that differ from the mean by more than the noise. The
// background then does not adapt either.
#pragma once
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "capture_node/segmentation/background.h"
#include "capture_node/segmentation/difference.h"
#include "capture_node/segmentation/gain.h"
#include "common/config/capture/capture_config.h"
#include "common/hull/coverage/coverage_map.h"
#include "common/hull/hull.h"

namespace fivepipe::capture {

LearningSettings learning_settings(const config::SegmentationConfig& config);
Tolerances tolerances(const config::SegmentationConfig& config);

// What the steps found in one captured image.
struct Segmentation {
  Gain gain = {1, 1, 1};
  Difference difference;
  hull::ObjectPixels object;
  // Of the object, if the caller wants sub-pixel silhouettes.
  std::optional<hull::CoverageMap> coverage;
};

class Segmenter {
 public:
  // `within`, if it is given, has the size of the background (asserted). Only its pixels can be
  // object pixels.
  Segmenter(Background background, const config::SegmentationConfig& config,
            std::optional<hull::ObjectPixels> within = {});

  // Returns nullopt unless the image is 8-bit BGR of the background's size. With adaptation, each
  // call changes the background: everywhere by the gain, with its moving pixels' colours, and away
  // from objects by what remains.
  std::optional<Segmentation> segment(const cv::Mat& image_bgr);
  // Returns the coverage of the object pixels that segment() found in this image.
  hull::CoverageMap coverage(const cv::Mat& image_bgr, const Segmentation& of) const;

  // Period of the images [s], for the adaptation; 1/30 by default.
  void set_period_s(double period_s) { period_s_ = period_s; }

  static constexpr int kShadowNeighbours = 3, kObjectNeighbours = 4, kMajority = 5;

 private:
  hull::ObjectPixels object_pixels(const Difference& difference) const;
  // gain: of the image, exact.
  void adapt(const cv::Mat& image_bgr, const Gain& gain, const hull::ObjectPixels& object);

  config::SegmentationConfig config_;
  Background background_;
  DifferenceTables tables_;
  std::optional<GainEstimator> gain_estimator_;  // nullopt: no compensation
  std::vector<Gain> brighter_;                   // since the background was learned, by row
  std::optional<hull::ObjectPixels> within_;
  double period_s_ = 1.0 / 30;
  int next_row_ = 0;  // to be adapted
};

// Adaptation visits one row in this many of each image, which bounds its time.
inline constexpr int kAdaptationRows = 64;
// Largest relative step of the background towards the gain: the rows take it one after the other,
// and until the last one has, they differ by it, which the noise thresholds must tolerate.
inline constexpr double kMaxGainStep = 0.01;
// Distance from object pixels within which the background adapts to the gain alone: the object's
// blur and shadow are near it.
inline constexpr int kAdaptationMargin_px = 16;

// Returns diagnostics of one camera's published object pixels for the user; empty if they are
// plausible. outside_published: number of object pixels that the published image does not contain.
// `limits`: of the deployment's hull.
std::vector<std::string> segmentation_diagnostics(const hull::ObjectPixels& pixels,
                                                  std::size_t outside_published = 0,
                                                  hull::Limits limits = hull::Limits::all);
// Objects fill a smaller fraction of an image in every rig: a larger one means that exposure or
// light has changed, or that the camera has moved.
inline constexpr double kMaxPlausibleFraction = 0.6;

}  // namespace fivepipe::capture
