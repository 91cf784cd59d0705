// What the steps of segmentation miss and remove, as `bench capture` measures it.
#include <gtest/gtest.h>

#include "benchmarks/capture/step_report.h"

namespace fivepipe::capture_bench {
namespace {

TEST(CaptureSteps, CountMissedAndFalsePixels) {
  Sequence images{Disturbance::noise, {}, {}, {}};
  const cv::Mat room(60, 80, CV_8UC3, cv::Scalar::all(100));
  images.learning = {room};
  cv::Mat with_object = room.clone();
  with_object(cv::Rect(10, 10, 20, 20)).setTo(cv::Scalar(200, 60, 100));
  images.images = {with_object, with_object};
  hull::ObjectPixels truth(80, 60);
  for (int v = 10; v < 30; ++v) truth.set_run(15, 35, v);  // 5 pixels to the right
  images.truth = {truth, truth};
  const PixelErrors errors = errors_of({}, images);
  EXPECT_DOUBLE_EQ(errors.missed_fraction, 0.25);
  EXPECT_DOUBLE_EQ(errors.false_px, 100);
}

// Each step against the disturbance that it is for.
TEST(CaptureSteps, RemoveFalsePixels) {
  const auto false_px = [](Disturbance disturbance, auto change) {
    config::SegmentationConfig config;
    change(config);
    return errors_of(config, sequence(disturbance, kMeasuredSeeds[0], 180, 122)).false_px;
  };
  using Config = config::SegmentationConfig;
  const auto defaults = [](Config&) {};
  EXPECT_GT(false_px(Disturbance::shadow, [](Config& c) { c.shadow_min_brightness = 1; }),
            5 * false_px(Disturbance::shadow, defaults) + 10);
  EXPECT_GT(false_px(Disturbance::drift, [](Config& c) { c.gain_compensation = false; }),
            5 * false_px(Disturbance::drift, defaults) + 10);
  EXPECT_GT(false_px(Disturbance::noise, [](Config& c) { c.conservative = true; }),
            false_px(Disturbance::noise, defaults));
}

TEST(CaptureSteps, ConservativeMissesNoMore) {
  config::SegmentationConfig conservative;
  conservative.conservative = true;
  for (const Disturbance disturbance : kDisturbances) {
    const Sequence images = sequence(disturbance, kMeasuredSeeds[0], 180, 122);
    EXPECT_LE(errors_of(conservative, images).missed_fraction,
              errors_of({}, images).missed_fraction)
        << name_of(disturbance);
  }
}

}  // namespace
}  // namespace fivepipe::capture_bench
