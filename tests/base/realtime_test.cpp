#include "common/base/realtime.h"

#include <gtest/gtest.h>

#include <limits>

namespace fivepipe::base {
namespace {

TEST(Stamps, DifferencesSaturate) {
  EXPECT_EQ(difference_ns(7, 9), -2);
  EXPECT_EQ(difference_ns(INT64_MAX, INT64_MIN), INT64_MAX);
  EXPECT_EQ(difference_ns(INT64_MIN, INT64_MAX), INT64_MIN);
  EXPECT_EQ(difference_ns(0, INT64_MIN), INT64_MAX);
  EXPECT_EQ(difference_ns(-1, INT64_MIN), INT64_MAX);
  EXPECT_EQ(difference_ns(INT64_MIN, 0), INT64_MIN);
  EXPECT_EQ(distance_ns(9, 7), 2);
  EXPECT_EQ(distance_ns(7, 9), 2);
  // std::abs() of this difference would overflow.
  EXPECT_EQ(distance_ns(INT64_MIN, 0), INT64_MAX);
  EXPECT_EQ(distance_ns(INT64_MAX, INT64_MIN), INT64_MAX);
  EXPECT_DOUBLE_EQ(difference_s(1'500'000'000, 0), 1.5);
}

TEST(Stamps, SumsSaturate) {
  EXPECT_EQ(later_by_s(5, 2.5), 2'500'000'005);
  EXPECT_EQ(later_by_s(5, -1), -999'999'995);
  EXPECT_EQ(later_by_s(INT64_MAX, 1), INT64_MAX);
  EXPECT_EQ(later_by_s(INT64_MIN, -1), INT64_MIN);
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_GT(later_by_s(0, infinity), std::int64_t(4e18));
  EXPECT_LT(later_by_s(0, -infinity), std::int64_t(-4e18));
  EXPECT_EQ(later_by_s(INT64_MAX - 1, 1e300), INT64_MAX);
}

}  // namespace
}  // namespace fivepipe::base
