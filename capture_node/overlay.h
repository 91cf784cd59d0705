// Pictures that show what segmentation found, for people.
#pragma once
#include <opencv2/core.hpp>

#include "capture_node/segmentation/segmentation.h"
#include "common/config/rig.h"

namespace fivepipe::capture {

// Draws into a copy of the captured image: object pixels red with a white outline, shadow blue, and
// other pixels that differ but were dropped yellow. The rest is darkened. image: 8-bit BGR of the
// segmentation's size (asserted).
cv::Mat overlay(const cv::Mat& image_bgr, const Segmentation& segmentation);

// Draws the edges of a box of the world [m] in green and, from the world's origin, half a metre of
// its axes x in red, y in green and z in blue, where the lens of the camera shows them. The picture
// has the captured size.
void draw_volume(cv::Mat& picture_bgr, const config::RigCamera& camera,
                 const Eigen::AlignedBox3d& volume_m);

// 8-bit mask, 255 at object pixels.
cv::Mat mask_image(const hull::ObjectPixels& pixels);

}  // namespace fivepipe::capture
