#include "common/pipeline/node/drop_counts.h"

#include <gtest/gtest.h>

#include "common/pipeline/node/log_budget.h"

namespace fivepipe::node {
namespace {

using messages::BadMessage;
using namespace std::chrono_literals;

std::uint64_t sum_of(const DropCounts& drops) {
  std::uint64_t sum = 0;
  for (const auto& [bad, count] : drops.counts()) sum += count;
  return sum;
}

TEST(DropCounts, InventedSubjectsCountTogether) {
  DropCounts drops;
  constexpr std::uint64_t kMessages = 10'000;
  constexpr std::size_t kNames = 24;  // that a reason keeps: the limit of the memory
  for (std::uint64_t i = 0; i < kMessages; ++i) {
    drops.add({"bad_map", "invented_" + std::to_string(i), "unknown camera"}, 1);
    drops.add({"bad_state", "", std::to_string(i) + " vertices"}, 1);
  }
  EXPECT_EQ(sum_of(drops), 2 * kMessages);
  EXPECT_EQ(drops.counts().size(), 2 * (kNames + 1)) << "the names, and the others";
  EXPECT_EQ(drops.counts().at({"bad_map", DropCounts::kOther, ""}), kMessages - kNames);
}

// The flood of one reason hides neither another reason nor a known entry.
TEST(DropCounts, OtherReasonsKeepTheirSubjects) {
  DropCounts drops;
  drops.add({"bad_map", "left", "wrong image size"}, 1);
  for (int i = 0; i < 1000; ++i) drops.add({"bad_map", std::to_string(i), ""}, 1);
  EXPECT_EQ(drops.add({"bad_map", "left", "wrong image size"}, 2).second, 3u);
  EXPECT_EQ(drops.add({"bad_tile", "left", "detail"}, 1).first,
            (BadMessage{"bad_tile", "left", "detail"}));
  EXPECT_EQ(drops.add({"bad_map", "", ""}, 4).second, 4u) << "a reason alone is never 'other'";
}

TEST(NamedCounts, FurtherNamesCountAsOther) {
  NamedCounts counts(2, "other");
  for (const char* name : {"a", "b", "c", "d", "a"}) counts.add(name, 10);
  EXPECT_EQ(counts.counts(),
            (std::map<std::string, std::uint64_t>{{"a", 20}, {"b", 10}, {"other", 20}}));
}

TEST(LogBudget, GrantsABoundedNumberOfLinesPerPeriod) {
  LogBudget budget;
  const LogBudget::Clock::time_point start{100h};
  int granted = 0;
  for (int ms = 0; ms < 60'000; ++ms) granted += budget.take(start + std::chrono::milliseconds(ms));
  EXPECT_EQ(granted, 120) << "10 lines per 5 s";
  const auto end = start + 60s;
  EXPECT_EQ(budget.take_suppressed(end), 60'000u - std::uint64_t(granted));
  for (int line = 0; line <= LogBudget::kMaxLines; ++line) budget.take(end);
  EXPECT_EQ(budget.take_suppressed(end + 1s), 0u);
  EXPECT_EQ(budget.take_suppressed(end + LogBudget::kPeriod), 1u);
}

}  // namespace
}  // namespace fivepipe::node
