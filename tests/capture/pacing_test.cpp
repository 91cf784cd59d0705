#include <gtest/gtest.h>

#include "capture_node/pacing/pacing.h"

namespace fivepipe::capture {
namespace {

using namespace std::chrono_literals;
const Pacing::Clock::time_point kStart{};

TEST(Pacing, IssuesEachFrameOnceAtItsTime) {
  Pacing pacing(100, 0, kStart);
  EXPECT_EQ(pacing.next(kStart, true), 0);
  EXPECT_EQ(pacing.next(kStart + 9ms, true), std::nullopt);
  EXPECT_EQ(pacing.next_wakeup(kStart + 9ms), kStart + 10ms);
  EXPECT_EQ(pacing.next(kStart + 10ms, true), 1);
  EXPECT_EQ(pacing.next(kStart + 11ms, true), std::nullopt);
  EXPECT_EQ(pacing.take_skipped(), 0u);
}

TEST(Pacing, SkipsAndCountsFramesMissedWhileBusy) {
  Pacing pacing(100, 0, kStart);
  pacing.next(kStart, true);
  EXPECT_EQ(pacing.next(kStart + 55ms, true), 5);
  EXPECT_EQ(pacing.take_skipped(), 4u);
  EXPECT_EQ(pacing.take_skipped(), 0u);
}

TEST(Pacing, WaitsWhileTooManyFramesAreInFlight) {
  Pacing pacing(100, 2, kStart);
  EXPECT_EQ(pacing.next(kStart, true), 0);
  EXPECT_EQ(pacing.next(kStart + 10ms, true), 1);
  EXPECT_EQ(pacing.next(kStart + 20ms, true), std::nullopt);
  pacing.composited(0, kStart + 35ms);
  EXPECT_EQ(pacing.next(kStart + 35ms, true), 3);
  EXPECT_EQ(pacing.take_skipped(), 1u);
  EXPECT_EQ(pacing.next(kStart + 40ms, true), std::nullopt);
}

TEST(Pacing, NewerCompositeReleasesOlderFrames) {
  Pacing pacing(100, 2, kStart);
  pacing.next(kStart, true);
  pacing.next(kStart + 10ms, true);
  pacing.composited(1, kStart + 12ms);
  EXPECT_EQ(pacing.next(kStart + 20ms, true), 2);
  EXPECT_EQ(pacing.next(kStart + 30ms, true), 3);
}

TEST(Pacing, RunsByClockWithoutRenderer) {
  Pacing pacing(100, 1, kStart);
  for (int frame = 0; frame < 20; ++frame)
    EXPECT_EQ(pacing.next(kStart + frame * 10ms, false), frame);
}

TEST(Pacing, StallTimeoutReleasesFramesInFlight) {
  Pacing pacing(100, 2, kStart);
  EXPECT_EQ(pacing.next(kStart, true), 0);
  EXPECT_EQ(pacing.next(kStart + 10ms, true), 1);
  EXPECT_EQ(pacing.next(kStart + 490ms, true), std::nullopt);
  EXPECT_EQ(pacing.next(kStart + 500ms, true), 50);
  EXPECT_EQ(pacing.next(kStart + 510ms, true), 51);
  EXPECT_EQ(pacing.next(kStart + 520ms, true), std::nullopt);
}

TEST(Pacing, StallTimeoutBeginsAtTheLastComposite) {
  Pacing pacing(100, 2, kStart);
  EXPECT_EQ(pacing.next(kStart, true), 0);
  EXPECT_EQ(pacing.next(kStart + 10ms, true), 1);
  pacing.composited(0, kStart + 300ms);
  EXPECT_EQ(pacing.next(kStart + 310ms, true), 31);
  EXPECT_EQ(pacing.next(kStart + 799ms, true), std::nullopt);
  EXPECT_EQ(pacing.next(kStart + 800ms, true), 80);
  EXPECT_EQ(pacing.next(kStart + 810ms, true), 81);
  EXPECT_EQ(pacing.next(kStart + 1299ms, true), std::nullopt);
  EXPECT_EQ(pacing.next(kStart + 1300ms, true), 130);
  EXPECT_EQ(pacing.take_skipped(), 130u - 5);
}

// Composited every 10 ms at first.
TEST(Pacing, TheStallTimeoutIsFourUsualPeriods) {
  Pacing pacing(1000, 2, kStart);
  EXPECT_EQ(pacing.stall_timeout(), 500ms);
  auto composite_every = [&, frame = 0, now = kStart](std::chrono::milliseconds period,
                                                      int times) mutable {
    for (int i = 0; i < times; ++i, ++frame) {
      now += period;
      pacing.next(now, true);
      pacing.composited(std::uint64_t(frame), now);
    }
  };
  composite_every(10ms, 1);
  EXPECT_EQ(pacing.stall_timeout(), 500ms) << "no period yet";
  composite_every(10ms, 1);
  EXPECT_EQ(pacing.stall_timeout(), 150ms);
  composite_every(60ms, 9);
  EXPECT_EQ(pacing.stall_timeout(), 240ms);
  composite_every(400ms, 9);
  EXPECT_EQ(pacing.stall_timeout(), 500ms);
}

TEST(Pacing, FramesThatAreGivenUpAreNotInFlight) {
  Pacing pacing(100, 2, kStart);
  EXPECT_EQ(pacing.next(kStart, true), 0);
  EXPECT_EQ(pacing.next(kStart + 10ms, true), 1);
  EXPECT_EQ(pacing.next(kStart + 20ms, true), std::nullopt);
  pacing.give_up(0, kStart + 20ms);
  EXPECT_EQ(pacing.next(kStart + 20ms, true), 2);
  EXPECT_EQ(pacing.next(kStart + 30ms, true), std::nullopt);
  pacing.give_up_all(kStart + 30ms);
  EXPECT_EQ(pacing.next(kStart + 30ms, true), 3);
  EXPECT_EQ(pacing.next(kStart + 40ms, true), 4);
  EXPECT_EQ(pacing.next(kStart + 50ms, true), std::nullopt);
  EXPECT_EQ(pacing.stall_timeout(), 500ms) << "a frame that is given up is not composited";
}

TEST(Pacing, CompositesInAnyOrderReleaseOnlyOlderFrames) {
  Pacing pacing(100, 3, kStart);
  for (int frame = 0; frame < 3; ++frame) pacing.next(kStart + frame * 10ms, true);
  pacing.composited(1, kStart + 21ms);
  pacing.composited(0, kStart + 22ms);
  EXPECT_EQ(pacing.next(kStart + 30ms, true), 3);
  EXPECT_EQ(pacing.next(kStart + 40ms, true), 4);
  EXPECT_EQ(pacing.next(kStart + 50ms, true), std::nullopt) << "2, 3 and 4 are in flight";
}

// Longer than its buffer of issued frames.
TEST(Pacing, KeepsTheLimitThroughManyFrames) {
  constexpr int kInFlight = 5;
  Pacing pacing(100, kInFlight, kStart);
  for (int frame = 0; frame < 300; ++frame) {
    const auto now = kStart + frame * 10ms + 1ms;  // more than the rounding of the clock
    if (frame >= kInFlight) {
      EXPECT_EQ(pacing.next(now, true), std::nullopt) << frame;
      pacing.composited(std::uint64_t(frame - kInFlight), now);
    }
    EXPECT_EQ(pacing.next(now, true), frame);
  }
  EXPECT_EQ(pacing.take_skipped(), 0u);
}

// 64 is the largest number that a deployment may allow.
TEST(Pacing, HoldsBackTheFrameAfter64InFlight) {
  Pacing pacing(100, 64, kStart);
  for (int frame = 0; frame < 64; ++frame)
    ASSERT_TRUE(pacing.next(kStart + frame * 11ms, true)) << frame;
  const auto now = kStart + 64 * 11ms;
  pacing.composited(0, now);
  EXPECT_TRUE(pacing.next(now + 10ms, true)) << "one has left";
  EXPECT_FALSE(pacing.next(now + 20ms, true));
}

TEST(Pacing, WakesAtOnceIfTheNextFrameIsLate) {
  Pacing pacing(100, 1, kStart);
  EXPECT_EQ(pacing.next_wakeup(kStart), kStart);
  pacing.next(kStart + 20ms, true);
  EXPECT_EQ(pacing.next_wakeup(kStart + 20ms), kStart + 30ms);
  EXPECT_EQ(pacing.next_wakeup(kStart + 30ms), kStart + 30ms);
  EXPECT_EQ(pacing.next_wakeup(kStart + 47ms), kStart + 47ms);
}

TEST(Pacing, IgnoresCompositesOfFramesFromEarlierProcess) {
  Pacing pacing(100, 1, kStart);
  EXPECT_EQ(pacing.next(kStart, true), 0);
  pacing.composited(5000, kStart + 5ms);
  EXPECT_EQ(pacing.next(kStart + 10ms, true), std::nullopt);
}

}  // namespace
}  // namespace fivepipe::capture
