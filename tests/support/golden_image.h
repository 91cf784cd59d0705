// Compares an image with the one in tests/golden. FIVEPIPE_WRITE_GOLDEN=1 replaces that image;
// inspect it before you commit it.
#pragma once
#include <gtest/gtest.h>

#include <cstdlib>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>

namespace fivepipe::test {

struct GoldenTolerance {
  double mean_levels;          // of the absolute difference
  int pixel_levels;            // more than this is a wrong pixel
  double wrong_pixels = 0.02;  // at most this fraction
};

inline void expect_golden(const cv::Mat& image, const std::string& name,
                          const GoldenTolerance& tolerance) {
  const std::string file = std::string(FIVEPIPE_SOURCE_DIR) + "/tests/golden/" + name;
  if (std::getenv("FIVEPIPE_WRITE_GOLDEN")) cv::imwrite(file, image);
  const cv::Mat golden = cv::imread(file);
  ASSERT_EQ(golden.size(), image.size()) << file;
  cv::Mat difference;
  cv::absdiff(image, golden, difference);
  EXPECT_LT(cv::mean(difference.reshape(1))[0], tolerance.mean_levels) << file;
  const cv::Mat wrong = difference.reshape(1) > tolerance.pixel_levels;
  EXPECT_LE(cv::countNonZero(wrong), tolerance.wrong_pixels * double(wrong.total())) << file;
}

}  // namespace fivepipe::test
