// Images of random levels.
#pragma once
#include <opencv2/core.hpp>
#include <random>

namespace fivepipe::test {

inline cv::Mat random_image(int width_px, int height_px, unsigned seed) {
  std::mt19937 random(seed);
  cv::Mat image(height_px, width_px, CV_8UC3);
  for (int i = 0; i < 3 * width_px * height_px; ++i) image.data[i] = std::uint8_t(random());
  return image;
}

}  // namespace fivepipe::test
