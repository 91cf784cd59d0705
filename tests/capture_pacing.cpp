#include <gtest/gtest.h>

#include "capture_node/pacing.h"

namespace fivepipe {
namespace {

using namespace std::chrono_literals;
const Pacing::Clock::time_point kStart{};

TEST(Pacing, NamesEachFrameOnceAtItsTime) {
  Pacing pacing(100, 0, kStart);
  EXPECT_EQ(pacing.next(kStart), 0);
  EXPECT_EQ(pacing.next(kStart + 9ms), std::nullopt);
  EXPECT_EQ(pacing.wake(kStart + 9ms), kStart + 10ms);
  EXPECT_EQ(pacing.next(kStart + 10ms), 1);
  EXPECT_EQ(pacing.next(kStart + 11ms), std::nullopt);
  EXPECT_EQ(pacing.take_skipped(), 0u);
}

TEST(Pacing, SkipsAndCountsWhatABusyNodeMissed) {
  Pacing pacing(100, 0, kStart);
  pacing.next(kStart);
  EXPECT_EQ(pacing.next(kStart + 55ms), 5);
  EXPECT_EQ(pacing.take_skipped(), 4u);
  EXPECT_EQ(pacing.take_skipped(), 0u);
}

TEST(Pacing, HoldsBackWhileTooManyFramesAreInFlight) {
  Pacing pacing(100, 2, kStart);
  EXPECT_EQ(pacing.next(kStart), 0);
  EXPECT_EQ(pacing.next(kStart + 10ms), 1);
  EXPECT_EQ(pacing.next(kStart + 20ms), std::nullopt);
  pacing.composited(0, kStart + 35ms);
  EXPECT_EQ(pacing.next(kStart + 35ms), 3);
  EXPECT_EQ(pacing.take_skipped(), 1u);
  EXPECT_EQ(pacing.next(kStart + 40ms), std::nullopt);
}

TEST(Pacing, CompositingANewerFrameFreesTheOlderOnes) {
  Pacing pacing(100, 2, kStart);
  pacing.next(kStart);
  pacing.next(kStart + 10ms);
  pacing.composited(1, kStart + 12ms);
  EXPECT_EQ(pacing.next(kStart + 20ms), 2);
  EXPECT_EQ(pacing.next(kStart + 30ms), 3);
}

TEST(Pacing, GoesOnByTheClockWhenNobodyComposites) {
  Pacing pacing(100, 1, kStart);
  EXPECT_EQ(pacing.next(kStart), 0);
  EXPECT_EQ(pacing.next(kStart + 490ms), std::nullopt);
  EXPECT_EQ(pacing.next(kStart + 500ms), 50);
  EXPECT_EQ(pacing.next(kStart + 510ms), 51);
}

TEST(Pacing, WordOfFramesThatAnEarlierProcessNamedIsIgnored) {
  Pacing pacing(100, 1, kStart);
  EXPECT_EQ(pacing.next(kStart), 0);
  pacing.composited(5000, kStart + 5ms);
  EXPECT_EQ(pacing.next(kStart + 10ms), std::nullopt);
}

}  // namespace
}  // namespace fivepipe
