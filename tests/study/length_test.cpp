#include "launch/units/length.h"

#include <gtest/gtest.h>

#include <limits>

namespace fivepipe::study {
namespace {

TEST(Length, HasAUnit) {
  EXPECT_DOUBLE_EQ(*length_m("18cm"), 0.18);
  EXPECT_DOUBLE_EQ(*length_m("18 cm"), 0.18);
  EXPECT_DOUBLE_EQ(*length_m(" +180mm "), 0.18);
  EXPECT_DOUBLE_EQ(*length_m("-0.18m"), -0.18);
  EXPECT_DOUBLE_EQ(*length_m("1e-1 m"), 0.1);
  EXPECT_DOUBLE_EQ(*length_m("10in"), 0.254);
  EXPECT_EQ(length_m("0mm"), 0);
}

TEST(Length, RefusesOtherTexts) {
  for (const char* text : {"", " ", "18", "cm", "18 km", "18cm2", "1,8cm", "nan m", "inf m",
                           "1e999m", "18c m", "--1m", "+-1m", "0x10m", "18CM"})
    EXPECT_FALSE(length_m(text)) << text;
}

TEST(Length, IsShownInCentimetres) {
  EXPECT_EQ(text_of_length(0.225), "22.5 cm");
  EXPECT_EQ(text_of_length(-0.1), "-10.0 cm");
  EXPECT_EQ(text_of_length(std::numeric_limits<double>::infinity()), "none");
}

}  // namespace
}  // namespace fivepipe::study
