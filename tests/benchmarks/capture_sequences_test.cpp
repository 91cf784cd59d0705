// The sequences disturb segmentation as they claim, and their truth is true.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "benchmarks/capture/sequences.h"

namespace fivepipe::capture_bench {
namespace {

constexpr int kWidth_px = 180, kHeight_px = 122;

Sequence small_sequence(Disturbance disturbance) {
  return sequence(disturbance, 1, kWidth_px, kHeight_px);
}

double mean_level(const cv::Mat& bgr) {
  const cv::Scalar mean = cv::mean(bgr);
  return (mean[0] + mean[1] + mean[2]) / 3;
}

// The largest difference of the channels.
int difference(const cv::Mat& a, const cv::Mat& b, int u, int v) {
  int largest = 0;
  for (int c = 0; c < 3; ++c)
    largest = std::max(largest, std::abs(int(a.ptr(v)[3 * u + c]) - int(b.ptr(v)[3 * u + c])));
  return largest;
}

// Fractions of the pixels that differ from the first learning image by more than its noise: of the
// object, and of the rest.
struct Changed {
  double object = 0, rest = 0;
};
Changed changed(const Sequence& sequence) {
  constexpr int kNoise = 16;  // 8 standard deviations of each, about 5.6 of the difference
  double objects = 0, rests = 0;
  Changed sum;
  for (int i = 0; i < kImages; ++i)
    for (int v = 0; v < kHeight_px; ++v)
      for (int u = 0; u < kWidth_px; ++u) {
        const bool is_changed =
            difference(sequence.images[std::size_t(i)], sequence.learning[0], u, v) > kNoise;
        const bool is_object = sequence.truth[std::size_t(i)].contains(u, v);
        (is_object ? objects : rests) += 1;
        (is_object ? sum.object : sum.rest) += is_changed;
      }
  return {sum.object / objects, sum.rest / rests};
}

TEST(CaptureSequences, HaveTheirImagesAndTheTruth) {
  for (const Disturbance disturbance : kDisturbances) {
    const Sequence found = small_sequence(disturbance);
    EXPECT_EQ(found.disturbance, disturbance);
    ASSERT_EQ(found.learning.size(), std::size_t(kLearningImages)) << name_of(disturbance);
    ASSERT_EQ(found.images.size(), std::size_t(kImages));
    ASSERT_EQ(found.truth.size(), std::size_t(kImages));
    for (const cv::Mat& image : found.images) {
      EXPECT_EQ(image.type(), CV_8UC3);
      EXPECT_EQ(image.size(), cv::Size(kWidth_px, kHeight_px));
    }
    for (const hull::ObjectPixels& truth : found.truth) {
      EXPECT_GT(truth.count(), 500u) << name_of(disturbance);
      EXPECT_LT(truth.count(), std::size_t(kWidth_px * kHeight_px / 2));
    }
  }
}

TEST(CaptureSequences, AreDeterminedByTheSeed) {
  for (const Disturbance disturbance : kDisturbances) {
    const auto with_seed = [&](int seed) { return sequence(disturbance, seed, 60, 41); };
    const Sequence a = with_seed(5), b = with_seed(5), other = with_seed(6);
    for (std::size_t i = 0; i < a.images.size(); ++i) {
      EXPECT_EQ(cv::norm(a.images[i], b.images[i], cv::NORM_INF), 0);
      EXPECT_EQ(a.truth[i], b.truth[i]);
    }
    EXPECT_GT(cv::norm(a.images[0], other.images[0], cv::NORM_INF), 20);
  }
}

// Without another disturbance, nearly all object pixels and nearly no others differ from the room.
TEST(CaptureSequences, OfNoiseShowTheObjectAlone) {
  const Changed found = changed(small_sequence(Disturbance::noise));
  EXPECT_GT(found.object, 0.93);
  EXPECT_LT(found.rest, 1e-3);
}

TEST(CaptureSequences, TheShadowIsOutsideTheObject) {
  const Changed found = changed(small_sequence(Disturbance::shadow));
  EXPECT_GT(found.object, 0.93);
  EXPECT_GT(found.rest, 0.01);
  EXPECT_LT(found.rest, 0.3);
}

TEST(CaptureSequences, FlickerIsInAllImages) {
  const Sequence found = small_sequence(Disturbance::flicker);
  const auto spread = [](const std::vector<cv::Mat>& images) {
    double least = 255, most = 0;
    for (const cv::Mat& image : images) {
      least = std::min(least, mean_level(image));
      most = std::max(most, mean_level(image));
    }
    return (most - least) / most;
  };
  for (const auto* images : {&found.learning, &found.images}) {
    EXPECT_GT(spread(*images), 0.07);
    EXPECT_LT(spread(*images), 0.13);
  }
}

TEST(CaptureSequences, DriftLeavesTheLearningImagesAndGrows) {
  const Sequence found = small_sequence(Disturbance::drift);
  const double learned = mean_level(found.learning.front());
  EXPECT_NEAR(mean_level(found.learning.back()), learned, 0.1);
  const Sequence still = small_sequence(Disturbance::noise);
  const auto gain = [&](std::size_t i) {
    return mean_level(found.images[i]) / mean_level(still.images[i]);
  };
  EXPECT_NEAR(std::abs(gain(9) - 1), 0.03, 0.006);
  EXPECT_NEAR(std::abs(gain(kImages - 1) - 1), 0.12, 0.015) << "saturated levels move less";
}

TEST(CaptureSequences, CamouflageLeavesThreeTenthsOfTheContrast) {
  const Sequence found = small_sequence(Disturbance::camouflage),
                 plain = small_sequence(Disturbance::noise);
  double contrast = 0, whole = 0;
  for (int i = 0; i < kImages; ++i)
    for (int v = 0; v < kHeight_px; ++v)
      for (int u = 0; u < kWidth_px; ++u) {
        const auto k = std::size_t(i);
        if (!found.truth[k].contains(u, v) ||
            difference(plain.images[k], plain.learning[0], u, v) < 60)
          continue;
        contrast += difference(found.images[k], found.learning[0], u, v);
        whole += difference(plain.images[k], plain.learning[0], u, v);
      }
  EXPECT_NEAR(contrast / whole, 0.3, 0.04);
}

TEST(CaptureSequences, LeavesMoveInTheUpperPart) {
  const Sequence found = small_sequence(Disturbance::waving);
  double moved[2] = {0, 0};  // fractions of the upper two fifths and of the rest
  for (int i = 1; i < kLearningImages; ++i)
    for (int v = 0; v < kHeight_px; ++v)
      for (int u = 0; u < kWidth_px; ++u)
        moved[v >= kHeight_px * 2 / 5] +=
            difference(found.learning[std::size_t(i)], found.learning[0], u, v) > 16;
  const double all = double(kWidth_px) * kHeight_px * (kLearningImages - 1);
  EXPECT_GT(moved[0] / all, 0.1);
  EXPECT_LT(moved[1] / all, 1e-3);
}

TEST(CaptureSequences, PassersByCoverAPixelInFewLearningImages) {
  const Sequence found = small_sequence(Disturbance::passers_by),
                 empty = small_sequence(Disturbance::noise);
  int covered = 0, most = 0;
  for (int v = 0; v < kHeight_px; ++v)
    for (int u = 0; u < kWidth_px; ++u) {
      int images = 0;
      for (std::size_t i = 0; i < found.learning.size(); ++i)
        images += difference(found.learning[i], empty.learning[i], u, v) > 0;
      covered += images > 0;
      most = std::max(most, images);
    }
  EXPECT_GT(covered, kWidth_px * kHeight_px / 3);
  EXPECT_LT(most, kLearningImages * 2 / 5) << "the median is that of the room";
  for (std::size_t i = 0; i < found.images.size(); ++i)
    EXPECT_EQ(cv::norm(found.images[i], empty.images[i], cv::NORM_INF), 0);
}

}  // namespace
}  // namespace fivepipe::capture_bench
