#include <gtest/gtest.h>

#include "common/base/math/splitmix64.h"
#include "common/base/math/srgb.h"

namespace fivepipe::base {
namespace {

// The outputs of the authors' generator with the seed 1234567, whose state grows by the golden
// ratio.
TEST(SplitMix64, GivesTheNumbersOfItsAuthors) {
  const std::uint64_t golden = 0x9e3779b97f4a7c15u, seed = 1234567;
  const std::uint64_t expected[] = {6457827717110365317u, 3203168211198807973u,
                                    9817491932198370423u, 4593380528125082431u,
                                    16408922859458223821u};
  for (std::uint64_t i = 0; i < 5; ++i) EXPECT_EQ(splitmix64(seed + i * golden), expected[i]) << i;
}

TEST(Srgb, IsLinearInTheDarkAndAPowerAbove) {
  EXPECT_EQ(linear_from_srgb(0), 0);
  EXPECT_NEAR(linear_from_srgb(0.02), 0.02 / 12.92, 1e-15);
  EXPECT_NEAR(linear_from_srgb(0.5), 0.21404114048223255, 1e-15);
  EXPECT_EQ(linear_from_srgb(1), 1);
  EXPECT_NEAR(linear_from_srgb(0.04045), linear_from_srgb(std::nextafter(0.04045, 1)), 1e-7);
}

}  // namespace
}  // namespace fivepipe::base
