// The difference image (paper, section 3.1) by table lookup: per pixel and channel the lowest and
// highest level that still belongs to the empty scene.
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
  // Planes b, g, r, row-major, because the SIMD code deinterleaves the image in registers and loads
  // the tables without a shuffle.
  std::array<std::vector<std::uint8_t>, 3> low, high;
};

// A level belongs to the empty scene if it is within max(floor_levels, sigmas * measured sigma)
// of the mean.
DifferenceTables difference_tables(const ReferenceImage& reference, double sigmas,
                                   double floor_levels);

struct Difference {
  hull::ObjectPixels differs;  // some channel is below low or above high
  hull::ObjectPixels darker;   // subset of `differs` with no channel above high: may be shadow
};
// image: 8-bit BGR of the tables' size (asserted).
Difference difference(const cv::Mat& image_bgr, const DifferenceTables& tables);

}  // namespace fivepipe::capture
