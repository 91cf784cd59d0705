// The notice in the composite, and when it is due.
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "render_node/output/notice.h"
#include "render_node/simulation_age.h"

namespace fivepipe::render {
namespace {

constexpr const char* kText = "No simulation: the virtual objects stand still";
constexpr std::int64_t kMax_ns = SimulationAge::kMaxAge_ns;

// The columns of the image with a bright pixel, from the first to the last.
cv::Range bright_columns(const cv::Mat& image) {
  cv::Range columns(image.cols, 0);
  for (int v = 0; v < image.rows; ++v)
    for (int u = 0; u < image.cols; ++u)
      if (image.at<cv::Vec3b>(v, u)[0] > 150)
        columns = {std::min(columns.start, u), std::max(columns.end, u + 1)};
  return columns;
}

TEST(Notice, IsABarAtTheLowerBorder) {
  for (const cv::Size size : {cv::Size(1280, 960), {640, 480}, {320, 240}, {64, 48}}) {
    cv::Mat image(size, CV_8UC3, cv::Scalar::all(100));
    draw_notice(image, kText, 1);
    const int bar_px = size.height / 16;
    const cv::Mat above = image.rowRange(0, size.height - bar_px);
    EXPECT_EQ(cv::norm(above, cv::Mat(above.size(), CV_8UC3, cv::Scalar::all(100)), cv::NORM_INF),
              0);
    const cv::Mat bar = image.rowRange(size.height - bar_px, size.height);
    EXPECT_EQ(bar.at<cv::Vec3b>(0, 0), cv::Vec3b(25, 25, 25));
    if (size.width < 320) continue;  // too small for letters
    const cv::Range text = bright_columns(bar);
    EXPECT_GT(text.size(), size.width / 3) << size;
    EXPECT_NEAR(text.start, size.width - text.end, 4) << size;
    EXPECT_GT(text.start, 0) << size;
  }
}

TEST(Notice, StandsInTheImageOfEachEye) {
  cv::Mat image(480, 1280, CV_8UC3, cv::Scalar::all(100)),
      one(480, 640, CV_8UC3, cv::Scalar::all(100));
  draw_notice(image, kText, 2);
  draw_notice(one, kText, 1);
  for (const int eye : {0, 1})
    EXPECT_EQ(cv::norm(image.colRange(640 * eye, 640 * eye + 640), one, cv::NORM_INF), 0) << eye;
}

TEST(SimulationAge, IsCountedFromTheNewestState) {
  SimulationAge age(30);
  EXPECT_FALSE(age.is_missing(100, 100));
  EXPECT_FALSE(age.is_missing(100 + kMax_ns, 100));
  EXPECT_TRUE(age.is_missing(101 + kMax_ns, 100));
  EXPECT_FALSE(age.is_missing(102 + kMax_ns, 90 + kMax_ns));
  // An older state is drawn, because frames overtake each other.
  EXPECT_FALSE(age.is_missing(103 + kMax_ns, 50));
}

TEST(SimulationAge, IsCountedFromTheFirstFrameWithoutAnyState) {
  SimulationAge age(30);
  EXPECT_FALSE(age.is_missing(1000, {}));
  EXPECT_FALSE(age.is_missing(1000 + kMax_ns, {}));
  EXPECT_TRUE(age.is_missing(1001 + kMax_ns, {}));
  EXPECT_FALSE(age.is_missing(1002 + kMax_ns, 1002 + kMax_ns));
}

TEST(SimulationAge, ReportsItsReturnOnce) {
  SimulationAge age(30);
  const auto returns = [&](std::int64_t frame_ns, std::int64_t state_ns) {
    age.is_missing(frame_ns, state_ns);
    return age.has_returned();
  };
  EXPECT_FALSE(returns(1, 1)) << "it was not missing";
  EXPECT_FALSE(returns(kMax_ns + 2, 1)) << "it is missing";
  EXPECT_TRUE(returns(kMax_ns + 3, kMax_ns + 3));
  EXPECT_FALSE(returns(kMax_ns + 4, kMax_ns + 4)) << "reported already";
  EXPECT_FALSE(returns(2 * kMax_ns + 5, kMax_ns + 4));
  EXPECT_TRUE(returns(2 * kMax_ns + 6, 2 * kMax_ns + 6)) << "the next time";
}

TEST(SimulationAge, AtALowRateItMayBeThreePeriods) {
  SimulationAge age(2);
  EXPECT_FALSE(age.is_missing(1'500'000'000, 0));
  EXPECT_TRUE(age.is_missing(1'500'000'001, 0));
}

TEST(SimulationAge, AStateOfTheFutureDoesNotCount) {
  SimulationAge age(30);
  EXPECT_FALSE(age.is_missing(1000, 1000'000 * kMax_ns));
  EXPECT_FALSE(age.is_missing(1000 + kMax_ns, {}));
  EXPECT_TRUE(age.is_missing(1001 + kMax_ns, {}));
  // Capture begins again with an earlier clock.
  EXPECT_FALSE(age.is_missing(5, {}));
  EXPECT_TRUE(age.is_missing(6 + kMax_ns, {}));
}

}  // namespace
}  // namespace fivepipe::render
