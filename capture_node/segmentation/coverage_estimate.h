// The coverage of the pixels along the outline of segmented objects, for sub-pixel silhouettes.
//
// A pixel of which the object covers the fraction a shows the mixture I = a F + (1 - a) B of the
// object's colour F and that of the background B (the matting equation: Smith and Blinn 1996). B is
// what the background shows there, F the mean of the nearest pixels inside of the object, so that
// a = (I - B).(F - B) / |F - B|^2, the least-squares fit over the three channels.
#pragma once
#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <span>

#include "common/hull/coverage/coverage_map.h"
#include "common/hull/object_pixels.h"

namespace fivepipe::capture {

// The colour behind the objects: 3 levels b, g, r per pixel of the image, times the gain of the
// channels. Without levels, it is the mean of the nearest pixels outside of the objects.
struct BehindObjects {
  std::span<const float> levels = {};
  Eigen::Vector3f gain = Eigen::Vector3f::Ones();
};

// Returns the coverage of every pixel. image_bgr: 8-bit BGR of the objects' size (asserted). Only
// the object pixels at most 2 px inside of the outline and the pixels beside it are estimated. The
// border at one half stays within one pixel of the outline: pixels farther than 1 px inside have at
// least 128, those outside at most 127. Where object and background differ by less than
// kMinContrast_levels, and in parts without a pixel inside, the coverage is that of the object
// pixels, 0 or 255.
hull::CoverageMap estimated_coverage(const cv::Mat& image_bgr, const hull::ObjectPixels& object,
                                     const BehindObjects& behind);

// Length of F - B [grey levels of 255]. With noise of 2 levels, the error of the coverage is then a
// twelfth.
inline constexpr float kMinContrast_levels = 24;

}  // namespace fivepipe::capture
