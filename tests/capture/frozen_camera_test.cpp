#include "capture_node/sources/frozen_camera.h"

#include <gtest/gtest.h>

namespace fivepipe::capture {
namespace {

constexpr std::int64_t kMs = 1'000'000;

TEST(FrozenCamera, CountsTheTimeSinceTheImageChanged) {
  FrozenCamera camera;
  cv::Mat image(50, 64, CV_8UC3, cv::Scalar::all(90));
  EXPECT_EQ(camera.frozen_s(image, 0), 0);
  EXPECT_NEAR(camera.frozen_s(image.clone(), 40 * kMs), 0.04, 1e-9);
  EXPECT_NEAR(camera.frozen_s(image, 1500 * kMs), 1.5, 1e-9);
  image.at<cv::Vec3b>(48, 63)[2] ^= 1;  // the last byte of the last compared row
  EXPECT_EQ(camera.frozen_s(image, 1600 * kMs), 0);
  EXPECT_NEAR(camera.frozen_s(image, 1700 * kMs), 0.1, 1e-9);
  image.at<cv::Vec3b>(0, 0)[0] ^= 1;
  EXPECT_EQ(camera.frozen_s(image, 1800 * kMs), 0);
  EXPECT_EQ(camera.frozen_s(cv::Mat(66, 64, CV_8UC3, cv::Scalar::all(90)), 1900 * kMs), 0)
      << "another size";
}

// A camera of a region of its sensor delivers rows that are not contiguous.
TEST(FrozenCamera, ComparesOnlyTheImage) {
  FrozenCamera camera;
  cv::Mat sensor(40, 100, CV_8UC3, cv::Scalar::all(10));
  const cv::Mat image = sensor(cv::Rect(20, 4, 30, 20));
  camera.frozen_s(image, 0);
  sensor.at<cv::Vec3b>(4, 60)[0] = 200;
  EXPECT_NEAR(camera.frozen_s(image, 100 * kMs), 0.1, 1e-9);
}

}  // namespace
}  // namespace fivepipe::capture
