#include "common/pipeline/frames/restart_detector.h"

#include <gtest/gtest.h>

namespace fivepipe::frames {
namespace {

constexpr std::int64_t kPeriod_ns = 33'333'333;
std::int64_t stamp_ns(std::uint64_t frame) { return std::int64_t(1 + frame) * kPeriod_ns; }

// A late reader takes the 8 samples of its history camera by camera.
TEST(RestartDetector, LateMessagesOfManyCamerasAreNoRestart) {
  RestartDetector detector(RestartBy::stamp);
  EXPECT_FALSE(detector.is_restart(8, stamp_ns(8)));
  for (int camera = 0; camera < 8; ++camera)
    for (std::uint64_t frame = 0; frame < 8; ++frame)
      EXPECT_FALSE(detector.is_restart(frame, stamp_ns(frame))) << camera << ' ' << frame;
  EXPECT_FALSE(detector.is_restart(9, stamp_ns(9)));
}

TEST(RestartDetector, ALowerFrameOfALaterCaptureIsARestart) {
  RestartDetector detector(RestartBy::stamp);
  EXPECT_FALSE(detector.is_restart(5000, stamp_ns(5000)));
  EXPECT_TRUE(detector.is_restart(0, stamp_ns(5010)));
  EXPECT_FALSE(detector.is_restart(1, stamp_ns(5011))) << "reports a restart once";
}

// A slow camera's map may be captured later than a newer frame of the others.
TEST(RestartDetector, ByWriterALowerFrameOfALaterCaptureIsLate) {
  RestartDetector detector(RestartBy::writer);
  EXPECT_FALSE(detector.is_restart(5000, stamp_ns(5000)));
  EXPECT_FALSE(detector.is_restart(4999, stamp_ns(5100)));
  EXPECT_FALSE(detector.is_restart(5001, stamp_ns(5101)));
  // Many lower frames contradict the newest one as before.
  bool is_restarted = false;
  for (std::uint64_t frame = 0; frame < 16; ++frame) {
    EXPECT_FALSE(is_restarted);
    is_restarted = detector.is_restart(frame, stamp_ns(6000 + frame));
  }
  EXPECT_TRUE(is_restarted);
}

// The stamps do not show the restart: the frame is wrong, or the clock was set back.
TEST(RestartDetector, ManyFramesThatContradictTheNewestAreARestart) {
  constexpr std::uint64_t kFrames = 16;
  RestartDetector detector(RestartBy::stamp);
  EXPECT_FALSE(detector.is_restart(UINT64_MAX, INT64_MAX));
  // A second wrong frame is one of those that contradict the first one.
  EXPECT_FALSE(detector.is_restart(UINT64_MAX - 1, INT64_MAX));
  for (std::uint64_t frame = 0; frame + 2 < kFrames; ++frame)
    for (int camera = 0; camera < 8; ++camera)
      EXPECT_FALSE(detector.is_restart(frame, stamp_ns(frame)));
  EXPECT_TRUE(detector.is_restart(kFrames, stamp_ns(kFrames)));
  EXPECT_FALSE(detector.is_restart(kFrames + 1, stamp_ns(kFrames + 1)));
  EXPECT_FALSE(detector.is_restart(kFrames - 1, stamp_ns(kFrames - 1))) << "counts from 0 again";
}

TEST(RestartDetector, AllowsStampsToDifferBy200Ms) {
  constexpr std::int64_t kNewest_ns = 1'000'000'000, kMin_ns = 200'000'000;
  for (const std::int64_t more_ns : {0, 1}) {
    RestartDetector lower(RestartBy::stamp);
    EXPECT_FALSE(lower.is_restart(100, kNewest_ns));
    EXPECT_EQ(lower.is_restart(99, kNewest_ns + kMin_ns + more_ns), more_ns > 0);
    // A higher frame of an earlier capture contradicts the newest frame.
    RestartDetector higher(RestartBy::stamp);
    EXPECT_FALSE(higher.is_restart(100, kNewest_ns));
    bool restarted = false;
    for (std::uint64_t frame = 0; frame < 16; ++frame) {
      EXPECT_FALSE(restarted);
      restarted = higher.is_restart(101 + frame, kNewest_ns - kMin_ns - more_ns);
    }
    EXPECT_EQ(restarted, more_ns > 0);
  }
}

TEST(RestartDetector, ComparesWithTheFirstStampOfTheNewestFrame) {
  RestartDetector detector(RestartBy::stamp);
  for (const std::uint64_t frame : {10, 99, 100}) {
    EXPECT_FALSE(detector.is_restart(frame, stamp_ns(frame)));
  }
  EXPECT_FALSE(detector.is_restart(100, stamp_ns(104))) << "another camera";
  EXPECT_TRUE(detector.is_restart(50, stamp_ns(107)));
}

TEST(RestartDetector, CountsContradictionsInARow) {
  RestartDetector detector(RestartBy::stamp);
  std::uint64_t newest = 100;
  EXPECT_FALSE(detector.is_restart(newest, stamp_ns(newest)));
  for (std::uint64_t late = 0; late < 2 * RestartDetector::kMaxContradictions; ++late) {
    EXPECT_FALSE(detector.is_restart(late, stamp_ns(late)));
    if (late < RestartDetector::kMaxContradictions) ++newest;  // then another camera
    EXPECT_FALSE(detector.is_restart(newest, stamp_ns(newest)));
  }
}

}  // namespace
}  // namespace fivepipe::frames
