#include "common/pipeline/bus/arrival_times.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace fivepipe::bus::detail {
namespace {

TEST(ArrivalTimes, AreThoseOfTheSamplesOfEachWriter) {
  ArrivalTimes times;
  EXPECT_EQ(times.of(7, 100), std::nullopt);
  times.add(7, 100, 110);
  times.add(8, 100, 120);
  times.add(7, 101, 130);
  EXPECT_EQ(times.of(7, 100), 110);
  EXPECT_EQ(times.of(8, 100), 120);
  EXPECT_EQ(times.of(7, 101), 130);
  EXPECT_EQ(times.of(8, 101), std::nullopt);
  times.add(7, 100, 140);  // written twice in the same nanosecond
  EXPECT_EQ(times.of(7, 100), 140);
}

TEST(ArrivalTimes, OfADisplacedSampleTheOldestKnownOneCounts) {
  ArrivalTimes times;
  const auto newest = std::int64_t(3 * ArrivalTimes::kMaxSamples + 5);
  for (std::int64_t i = 0; i <= newest; ++i) times.add(7, i, i + 1);
  for (std::int64_t i = 0; i <= newest; ++i)
    EXPECT_EQ(times.of(7, i), std::max(i, newest - std::int64_t(ArrivalTimes::kMaxSamples) + 1) + 1)
        << i;
}

}  // namespace
}  // namespace fivepipe::bus::detail
