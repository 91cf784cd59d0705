// The difference image (paper, section 3.1), decided by table: per pixel and channel the lowest and
// highest level that still is the empty scene.
#pragma once
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "capture_node/segmentation/reference_image.h"
#include "common/hull/object_pixels.h"

namespace fivepipe::capture {

struct DifferenceTables {
  int width_px = 0, height_px = 0;
  // Planes b, g, r, row-major: loaded as they are, while the interleaved image is taken apart in
  // registers.
  std::array<std::vector<std::uint8_t>, 3> low, high;
};

// A level is the empty scene's where it is within max(floor_levels, sigmas * measured sigma) of the
// mean.
DifferenceTables difference_tables(const ReferenceImage& reference, double sigmas,
                                   double floor_levels);

struct Difference {
  hull::ObjectPixels differs;  // some channel is below low or above high
  hull::ObjectPixels darker;   // of those: no channel is above high, so it may be shadow
};
// image: 8-bit BGR of the tables' size.
Difference difference(const cv::Mat& image_bgr, const DifferenceTables& tables);

}  // namespace fivepipe::capture
