// Writes a notice into a composited image, for people who look at the picture alone.
#pragma once
#include <opencv2/core/mat.hpp>
#include <string>

namespace fivepipe::render {

// Draws the text in white on a dark bar at the lower border of each eye's image. The eyes are side
// by side. image_bgr: 8-bit BGR. The text fits into the width; a
// small image shows the bar alone.
void draw_notice(cv::Mat& image_bgr, const std::string& text, int eyes);

}  // namespace fivepipe::render
