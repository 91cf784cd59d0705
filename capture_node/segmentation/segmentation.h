// Image segmentation (paper, section 3.1): compares an image with the reference image of the empty
// scene and returns its object pixels in the published pinhole geometry.
#pragma once
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "capture_node/lens/undistortion.h"
#include "capture_node/segmentation/difference.h"
#include "capture_node/segmentation/reference_image.h"
#include "common/config/capture_config.h"
#include "common/hull/object_pixels.h"

namespace fivepipe::capture {

class Segmenter {
 public:
  // The reference must have the size of the camera's captured image (asserted).
  Segmenter(const config::RigCamera& camera, const ReferenceImage& reference,
            const config::SegmentationConfig& config);

  // Returns the object pixels in the geometry of the captured image, or nullopt unless the image is
  // 8-bit BGR of the captured size.
  std::optional<hull::ObjectPixels> segment_captured(const cv::Mat& source_bgr) const;
  // The same in the published geometry.
  std::optional<hull::ObjectPixels> segment(const cv::Mat& source_bgr) const;

  const Undistortion& undistortion() const { return undistortion_; }
  // Returns the number of these captured object pixels that are outside the published image.
  std::size_t count_outside_published(const hull::ObjectPixels& captured) const;

 private:
  void remove_shadow(const cv::Mat& source_bgr, Difference& difference) const;

  config::SegmentationConfig config_;
  DifferenceTables tables_;
  cv::Mat reference_bgr_;  // the mean, rounded
  Undistortion undistortion_;
  hull::ObjectPixels outside_published_;  // captured pixels
};

// Shadow preserves a surface's colour and reduces its brightness. With the pixel x and the
// reference r, s = x.r / r.r is the brightness ratio and |x - s r| the colour distortion, both in
// grey levels (Horprasert, Harwood, Davis 1999). Returns true if s is at least `min_brightness` and
// the colour distortion at most max(kShadowColour_levels, kShadowColourFraction * s|r|).
bool is_shadow(const std::uint8_t* pixel_bgr, const std::uint8_t* reference_bgr,
               double min_brightness);
// Noise of three channels and rounding of the reference.
inline constexpr float kShadowColour_levels = 8.0f;
// Indirect light from the walls has another tint than the blocked light: 3.4 degrees.
inline constexpr float kShadowColourFraction = 0.06f;

// Returns diagnostics of one camera's published object pixels for the user; empty if they are
// plausible. outside_published: number of object pixels that the published image does not contain.
std::vector<std::string> segmentation_diagnostics(const hull::ObjectPixels& pixels,
                                                  std::size_t outside_published = 0);
// Objects fill a smaller fraction of an image in every rig: a larger one means that exposure or
// light has changed, or that the camera has moved.
inline constexpr double kMaxPlausibleFraction = 0.6;

}  // namespace fivepipe::capture
