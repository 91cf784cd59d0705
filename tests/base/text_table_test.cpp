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

TEST(TextTable, AnEmptyColumnHasNoWidth) {
  TextTable table({{""}, {"b"}});
  table.add({"", "x"});
  EXPECT_EQ(table.text(), "  b\n  x\n");
}

TEST(TextTable, WrapsLongCellsAfterCommas) {
  TextTable table({{"list", false, 8}, {"n", true}, {"unlimited"}});
  table.add({"ab, cd, efg, hi", "1", "a, b, c"});
  table.add({"longer than that, x", "22", ""});
  table.add({"abc,d, efg", "3", "z"});
  EXPECT_EQ(table.text(),
            "list                n  unlimited\n"
            "ab, cd,             1  a, b, c\n"
            "efg, hi\n"
            "longer than that,  22\n"
            "x\n"
            "abc,d,              3  z\n"
            "efg\n");
}

TEST(TextTable, WrapsOnlyWhereALineWouldBeTooLong) {
  TextTable table({{"x", false, 7}});
  table.add({"abc, ef"});
  table.add({"abc, efg"});
  EXPECT_EQ(table.text(), "x\nabc, ef\nabc,\nefg\n");
}

TEST(TextTable, CountsInWords) {
  EXPECT_EQ(counted(0, "message"), "0 messages");
  EXPECT_EQ(counted(1, "message"), "1 message");
  EXPECT_EQ(counted(2, "message"), "2 messages");
  EXPECT_EQ(joined({"a", "b", "c"}, "; "), "a; b; c");
  EXPECT_EQ(joined({}, "; "), "");
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
  EXPECT_EQ(printable("\x1f \x7e\x7f\xe2\x82\xac"), "? ~?\xe2\x82\xac");
}

}  // namespace
}  // namespace fivepipe::base
