#include "common/base/timing.h"

#include <gtest/gtest.h>

namespace fivepipe::base {
namespace {

TEST(Percentile, IsTheNearestRank) {
  const std::vector<double> values{5, 1, 4, 2, 3};
  EXPECT_EQ(percentile(values, 0), 1);
  EXPECT_EQ(percentile(values, 0.2), 1);
  EXPECT_EQ(percentile(values, 0.21), 2);
  EXPECT_EQ(percentile(values, 0.5), 3);
  EXPECT_EQ(percentile(values, 0.99), 5);
  EXPECT_EQ(percentile(values, 1), 5);
  EXPECT_EQ(percentile({}, 0.5), 0);
}

TEST(Mean, IsZeroWithoutValues) {
  EXPECT_EQ(mean({}), 0);
  EXPECT_EQ(mean({1, 2, 6}), 3);
}

TEST(TimeRoundRobin, WarmsUpOnceAndStartsEachRoundWithAnotherMethod) {
  std::vector<std::size_t> order;
  int warm_ups = 0;
  time_round_robin(3, {2, 1, 100}, [&](std::size_t method, bool counted) {
    order.push_back(method);
    warm_ups += !counted;
    return 1.0;
  });
  EXPECT_EQ(order, (std::vector<std::size_t>{0, 1, 2, 1, 2, 0, 2, 0, 1}));
  EXPECT_EQ(warm_ups, 3);
}

TEST(TimeRoundRobin, StopsASlowMethodAfterItsBudgetButNotBeforeTheMinimum) {
  std::vector<int> runs(2);
  time_round_robin(2, {10, 3, 0.5}, [&](std::size_t method, bool counted) {
    runs[method] += counted;
    return method == 0 ? 1000.0 : 1.0;
  });
  EXPECT_EQ(runs, (std::vector<int>{3, 10}));
}

TEST(TimeRoundRobin, AMethodMayTakeItsBudgetExactly) {
  std::vector<int> runs(2);
  time_round_robin(2, {10, 1, 3}, [&](std::size_t method, bool counted) {
    runs[method] += counted;
    return method == 0 ? 1000.0 : 1001.0;
  });
  EXPECT_EQ(runs, (std::vector<int>{4, 3}));
}

}  // namespace
}  // namespace fivepipe::base
