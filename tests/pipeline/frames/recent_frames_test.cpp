#include "common/pipeline/frames/recent_frames.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <optional>
#include <random>
#include <utility>
#include <vector>

namespace fivepipe::frames {
namespace {

TEST(RecentFrames, ACapacityOfZeroIsOne) {
  RecentFrames<int> table(0);
  EXPECT_FALSE(table.get_or_add(5).displaced);
  EXPECT_EQ(table.size(), 1u);
  EXPECT_EQ(table.get_or_add(4).displaced, 5u);
  EXPECT_EQ(table.size(), 1u);
  EXPECT_NE(table.find(4), nullptr);
}

TEST(RecentFrames, RemembersTheLast64DisplacedFrames) {
  RecentFrames<int> table(1);
  for (std::uint64_t frame = 0; frame <= 65; ++frame) table.get_or_add(frame);
  EXPECT_FALSE(table.was_displaced(0));
  for (std::uint64_t frame = 1; frame <= 64; ++frame) EXPECT_TRUE(table.was_displaced(frame));
  EXPECT_FALSE(table.was_displaced(65)) << "is in the table";
}

TEST(RecentFrames, AFrameThatIsAddedAgainOrClearedIsNotDisplaced) {
  RecentFrames<int> table(1);
  table.get_or_add(1);
  table.get_or_add(2);
  ASSERT_TRUE(table.was_displaced(1));
  table.get_or_add(1);
  EXPECT_FALSE(table.was_displaced(1));
  EXPECT_TRUE(table.was_displaced(2));
  table.clear();
  EXPECT_EQ(table.size(), 0u);
  EXPECT_FALSE(table.was_displaced(2));
}

// The reference is a list in the order of the additions.
TEST(RecentFrames, EqualsAListAfterRandomChanges) {
  constexpr std::size_t kCapacity = 5;
  std::mt19937 random(3);
  RecentFrames<int> table(kCapacity);
  std::deque<std::pair<std::uint64_t, int>> list;
  for (int i = 0; i < 5000; ++i) {
    const std::uint64_t frame = random() % 12;
    const auto at = std::find_if(list.begin(), list.end(),
                                 [&](const auto& entry) { return entry.first == frame; });
    if (const unsigned kind = random() % 8; kind == 0) {
      const std::optional<int> taken = table.take(frame);
      ASSERT_EQ(taken, at == list.end() ? std::nullopt : std::optional(at->second));
      if (at != list.end()) list.erase(at);
    } else if (kind == 1) {
      const std::size_t erased =
          std::erase_if(list, [](const auto& entry) { return entry.first <= 2; });
      ASSERT_EQ(table.erase_up_to(2), erased);
    } else {
      const auto& [value, displaced] = table.get_or_add(frame);
      const bool leaves = at == list.end() && list.size() == kCapacity;
      ASSERT_EQ(displaced, leaves ? std::optional(list.front().first) : std::nullopt);
      ASSERT_EQ(value, at == list.end() ? 0 : at->second);
      value = i;
      if (displaced) list.pop_front();
      if (const auto known = std::find_if(list.begin(), list.end(),
                                          [&](const auto& entry) { return entry.first == frame; });
          known != list.end())
        known->second = i;
      else
        list.emplace_back(frame, i);
    }
    ASSERT_TRUE(std::equal(table.begin(), table.end(), list.begin(), list.end(),
                           [](const auto& entry, const auto& of) {
                             return entry.frame == of.first && entry.value == of.second;
                           }));
    for (const auto& [known, value] : list) ASSERT_EQ(*std::as_const(table).find(known), value);
  }
}

TEST(RecentFrames, AClosedFrameIsTakenAndRemembered) {
  RecentFrames<int> table(2);
  table.get_or_add(7).value = 70;
  EXPECT_FALSE(table.was_displaced(7));
  EXPECT_EQ(table.close(7), 70);
  EXPECT_EQ(table.size(), 0u);
  EXPECT_TRUE(table.was_displaced(7));
  EXPECT_EQ(table.close(8), std::nullopt);
  EXPECT_TRUE(table.was_displaced(8));
  // As many as the table remembers.
  for (std::uint64_t frame = 100; frame < 100 + RecentFrames<int>::kMaxDisplaced; ++frame) {
    EXPECT_TRUE(table.was_displaced(8)) << frame;
    table.close(frame);
  }
  EXPECT_FALSE(table.was_displaced(8));
}

}  // namespace
}  // namespace fivepipe::frames
