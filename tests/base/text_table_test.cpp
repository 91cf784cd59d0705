#include "common/base/text_table.h"

#include <gtest/gtest.h>

#include <limits>

namespace fivepipe::base {
namespace {

TEST(TextTable, AlignsNumbersToTheRightAndTrimsLines) {
  TextTable table({{"name"}, {"n", true}});
  table.add({"a", "5"});
  table.add({"long name", "1234"});
  EXPECT_EQ(table.text(),
            "name          n\n"
            "a             5\n"
            "long name  1234\n");
}

TEST(TextTable, KeepsTheMinimumWidthOfAColumn) {
  TextTable table({{"a", false, 0, 6}, {"b", true, 0, 3}});
  table.add({"x", "1"});
  EXPECT_EQ(table.text(),
            "a         b\n"
            "x         1\n");
}

TEST(TextTable, ShowsNoDigitsOfInvalidNumbers) {
  EXPECT_EQ(with_decimals(1.25, 1), "1.2");
  EXPECT_EQ(with_decimals(-3, 0), "-3");
  EXPECT_EQ(with_decimals(std::numeric_limits<double>::quiet_NaN(), 2), "-");
  EXPECT_EQ(with_decimals(std::numeric_limits<double>::infinity(), 2), "-");
}

TEST(TextTable, ReplacesControlCharacters) {
  TextTable table({{"name"}});
  table.add({"a\x1b[31m\tb"});
  EXPECT_EQ(table.text(), "name\na?[31m?b\n");
}

}  // namespace
}  // namespace fivepipe::base
