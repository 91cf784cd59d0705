// Image segmentation (paper, section 3.1): the object pixels of an image against the reference
// image of the empty scene, in the published pinhole geometry.
#pragma once
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "capture_node/lens/undistortion.h"
#include "capture_node/segmentation/difference.h"
#include "capture_node/segmentation/reference_image.h"
#include "common/config/deployment.h"
#include "common/hull/object_pixels.h"

namespace fivepipe::capture {

class Segmenter {
 public:
  // The reference has the size of the camera's image as captured (asserted).
  Segmenter(const config::RigCamera& camera, const ReferenceImage& reference,
            const config::SegmentationConfig& config);

  // Object pixels in the published geometry; nothing where the image is not 8-bit BGR of the
  // captured size.
  std::optional<hull::ObjectPixels> segment(const cv::Mat& source_bgr) const;

  const Undistortion& undistortion() const { return undistortion_; }

 private:
  void remove_shadow(const cv::Mat& source_bgr, Difference& difference) const;

  config::SegmentationConfig config_;
  DifferenceTables tables_;
  cv::Mat reference_bgr_;  // the mean, rounded
  Undistortion undistortion_;
};

// Shadow keeps a surface's colour and takes its brightness. With x the pixel and r the reference, s
// = x.r / r.r is how dark it is and |x - s r| how far from the reference's colour, both in grey
// levels (Horprasert, Harwood, Davis 1999). Shadow: s at least `darkest` and the colour within the
// larger of kShadowColour_levels and kShadowColourFraction of s|r|.
bool is_shadow(const std::uint8_t* pixel_bgr, const std::uint8_t* reference_bgr, double darkest);
inline constexpr float kShadowColour_levels =
    8.0f;  // noise of three channels and the rounding of the reference
inline constexpr float kShadowColourFraction =
    0.06f;  // light from the walls has another tint than the light that is blocked: 3.4 degrees

// What a person should know about one camera's object pixels.
std::vector<std::string> segmentation_diagnostics(const hull::ObjectPixels& pixels);
// No rig has objects that fill so much of an image: its exposure or its light has changed, or the
// camera has moved.
inline constexpr double kMaxPlausibleFraction = 0.6;

}  // namespace fivepipe::capture
