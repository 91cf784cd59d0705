// Pictures that show what segmentation found, for people.
#pragma once
#include <opencv2/core.hpp>

#include "capture_node/segmentation/segmentation.h"

namespace fivepipe::capture {

// Draws into a copy of the captured image: object pixels red with a white outline, shadow blue, and
// other pixels that differ but were dropped yellow. The rest is darkened. image: 8-bit BGR of the
// segmentation's size (asserted).
cv::Mat overlay(const cv::Mat& image_bgr, const Segmentation& segmentation);

// 8-bit mask, 255 at object pixels.
cv::Mat mask_image(const hull::ObjectPixels& pixels);

}  // namespace fivepipe::capture
