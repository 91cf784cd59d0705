// The comparison with a golden image refuses a difference that a user would see and accepts that of
// rounding.
#include <gtest/gtest-spi.h>

#include <opencv2/imgproc.hpp>

#include "tests/scenes/golden_scenes.h"

namespace fivepipe::test {
namespace {

cv::Mat shifted(const cv::Mat& image, int right_px, int down_px) {
  cv::Mat result = image.clone();
  const cv::Size kept(image.cols - right_px, image.rows - down_px);
  image(cv::Rect({0, 0}, kept)).copyTo(result(cv::Rect({right_px, down_px}, kept)));
  return result;
}

class GoldenComparison : public testing::TestWithParam<GoldenScene> {
 protected:
  std::string why_not(const cv::Mat& image) const {
    return why_not_golden(image, golden_, GetParam().tolerance);
  }
  const cv::Mat golden_ = golden_of(GetParam());
};

TEST_P(GoldenComparison, AcceptsTheImageItself) {
  ASSERT_EQ(golden_.size(), cv::Size(640, 480));
  EXPECT_EQ(why_not(golden_), "");
}

TEST_P(GoldenComparison, AcceptsRoundedShades) {
  cv::Mat image = golden_.clone();
  for (int v = 0; v < image.rows; ++v)
    for (int u = v % 8; u < image.cols; u += 8) image.at<cv::Vec3b>(v, u) += cv::Vec3b(1, 1, 1);
  EXPECT_EQ(why_not(image), "");
}

TEST_P(GoldenComparison, RefusesAShiftByAPixel) {
  EXPECT_NE(why_not(shifted(golden_, 1, 0)), "");
  EXPECT_NE(why_not(shifted(golden_, 0, 1)), "");
}

TEST_P(GoldenComparison, RefusesALittleMoreLight) {
  EXPECT_NE(why_not(golden_ + cv::Scalar::all(1)), "");
}

// As large as the smallest moving object of the scenes, a cube of 4 cm.
TEST_P(GoldenComparison, RefusesARecolouredPatch) {
  cv::Mat image = golden_.clone();
  const cv::Rect patch(300, 220, kNoticed_px, kNoticed_px);
  image(patch) += cv::Scalar(40, 40, 40);
  EXPECT_NE(why_not(image), "");
}

TEST_P(GoldenComparison, RefusesAnImageOfAnotherSizeOrType) {
  EXPECT_NE(why_not(golden_.rowRange(0, 240)), "");
  cv::Mat grey;
  cv::cvtColor(golden_, grey, cv::COLOR_BGR2GRAY);
  EXPECT_NE(why_not(grey), "");
  EXPECT_NE(why_not({}), "");
  EXPECT_NE(why_not_golden(golden_, {}, GetParam().tolerance), "");
}

TEST(GoldenFailure, NamesTheImageAndTheDifferenceThatItKeeps) {
  const cv::Mat golden(2, 2, CV_8UC3, cv::Scalar(10, 20, 30));
  const cv::Mat image = golden + cv::Scalar(1, 0, 2);
  EXPECT_NONFATAL_FAILURE(
      expect_like_golden(image, golden, "failure/image.png", {.mean_levels = 0, .pixel_levels = 1}),
      "golden_failures/failure/image_x8.png");
  const std::filesystem::path folder =
      std::filesystem::path(FIVEPIPE_BINARY_DIR).parent_path() / "golden_failures" / "failure";
  EXPECT_EQ(cv::imread(folder / "image.png").at<cv::Vec3b>(1, 1), cv::Vec3b(11, 20, 32));
  EXPECT_EQ(cv::imread(folder / "image_x8.png").at<cv::Vec3b>(1, 1), cv::Vec3b(8, 0, 16));
  std::filesystem::remove_all(folder);
}

INSTANTIATE_TEST_SUITE_P(Scenes, GoldenComparison, testing::ValuesIn(kGoldenScenes),
                         [](const auto& scene) { return scene.param.name; });

}  // namespace
}  // namespace fivepipe::test
