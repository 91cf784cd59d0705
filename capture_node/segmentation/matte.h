// Object pixels without a learned background: from masks, from an alpha channel, and by the colour
// of a screen. No step removes or adds pixels, so an exact input gives the exact map.
#pragma once
#include <opencv2/core.hpp>

#include "common/config/capture/capture_config.h"
#include "common/hull/coverage/coverage_map.h"
#include "common/hull/object_pixels.h"

namespace fivepipe::capture {

// From this level on, a pixel of a mask or of an alpha channel is an object pixel.
inline constexpr int kOpaque_levels = 128;

// mask: 8-bit with 1 or 3 channels, of which the brightest counts.
hull::ObjectPixels pixels_of_mask(const cv::Mat& mask);
hull::CoverageMap coverage_of_mask(const cv::Mat& mask);  // its levels
// The last channel of an 8-bit image with 4 channels.
hull::ObjectPixels pixels_of_alpha(const cv::Mat& bgra);
hull::CoverageMap coverage_of_alpha(const cv::Mat& bgra);

// Objects in front of a screen of one colour. In the plane of the chroma components Cb and Cr
// (ITU-R BT.601), the screen is a direction: light and shadow on it change the length, hardly the
// direction.
class ChromaKeyer {
 public:
  // The colour of the key is not grey (asserted).
  explicit ChromaKeyer(const config::ChromaKey& key);
  // Returns the pixels without the colour of the screen. image: 8-bit BGR.
  hull::ObjectPixels object_pixels(const cv::Mat& image_bgr) const;

 private:
  float cb_, cr_;         // unit vector of the screen's chroma
  float min_chroma_;      // levels
  float squared_cosine_;  // of the largest angle
};

}  // namespace fivepipe::capture
