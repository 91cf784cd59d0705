#include "common/base/containers/bounded_map.h"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

namespace fivepipe::base {
namespace {

TEST(BoundedMap, ForgetsTheOldestEntry) {
  BoundedMap<int, std::string> map(2);
  EXPECT_TRUE(map.empty());
  EXPECT_EQ(map.set(1, "one"), "one");
  EXPECT_EQ(map.set(2, "two"), "two");
  EXPECT_EQ(map.set(3, "three"), "three");
  EXPECT_EQ(map.size(), 2u);
  EXPECT_EQ(map.find(1), nullptr);
  ASSERT_NE(map.find(2), nullptr);
  EXPECT_EQ(*map.find(2), "two");
  EXPECT_TRUE(map.contains(3));
}

TEST(BoundedMap, AChangedValueDoesNotMakeItsKeyNewer) {
  BoundedMap<int, int> map(2);
  map.set(1, 10);
  map.set(2, 20);
  EXPECT_EQ(map.set(1, 11), 11);
  EXPECT_EQ(map.size(), 2u);
  map.set(3, 30);
  EXPECT_FALSE(map.contains(1));
  EXPECT_TRUE(map.contains(2));
}

TEST(BoundedMap, ACapacityOfZeroIsOne) {
  BoundedMap<int, int> map(0);
  EXPECT_EQ(map.set(1, 10), 10);
  EXPECT_EQ(map.set(2, 20), 20);
  EXPECT_EQ(map.size(), 1u);
}

// The reference is a list in the order of the additions.
TEST(BoundedMap, EqualsAListAfterRandomChanges) {
  std::mt19937 random(3);
  BoundedMap<unsigned, int> map(5);
  std::vector<std::pair<unsigned, int>> list;
  for (int i = 0; i < 5000; ++i) {
    const unsigned key = random() % 12;
    const auto at = std::find_if(list.begin(), list.end(),
                                 [&](const auto& entry) { return entry.first == key; });
    map.set(key, i);
    if (at != list.end()) at->second = i;
    if (at == list.end()) list.emplace_back(key, i);
    if (list.size() > 5) list.erase(list.begin());
    ASSERT_EQ(map.size(), list.size());
    for (const auto& [k, v] : list) {
      ASSERT_TRUE(map.contains(k));
      ASSERT_EQ(*map.find(k), v);
    }
  }
}

}  // namespace
}  // namespace fivepipe::base
