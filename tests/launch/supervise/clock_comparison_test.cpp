// How far the clocks of two hosts are apart.
#include "launch/supervise/hosts/clock_comparison.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace fivepipe::launch {
namespace {

constexpr std::int64_t kMillisecond = 1'000'000, kSecond = 1000 * kMillisecond;

// The clock of the other host is ahead by offset_ns; a message takes this long there, waits, and
// takes this long back.
ClockExchange exchange(std::int64_t offset_ns, std::int64_t sent_ns, std::int64_t there_ns,
                       std::int64_t waits_ns, std::int64_t back_ns) {
  const std::int64_t received_ns = sent_ns + there_ns;
  return {sent_ns, received_ns + offset_ns, received_ns + waits_ns + offset_ns,
          received_ns + waits_ns + back_ns};
}

TEST(ClockComparison, HasNoOffsetBeforeTheFirstExchange) {
  EXPECT_EQ(ClockComparison().offset(0), std::nullopt);
}

TEST(ClockComparison, IsExactIfBothWaysTakeTheSameTime) {
  for (const std::int64_t offset_ns :
       {std::int64_t(0), 5 * kMillisecond, -150 * kMillisecond, 2 * kSecond}) {
    ClockComparison clock;
    clock.add(exchange(offset_ns, 100 * kSecond, kMillisecond, 0, kMillisecond));
    const auto measured = clock.offset(100 * kSecond + 2 * kMillisecond);
    ASSERT_TRUE(measured);
    EXPECT_EQ(measured->offset_ns, offset_ns);
    EXPECT_GE(measured->error_ns, kMillisecond);
    EXPECT_LT(measured->error_ns, kMillisecond + 1000);
  }
}

// The messages take random times, and the clocks drift apart.
TEST(ClockComparison, TheErrorBoundsTheOffset) {
  std::mt19937 random(17);
  std::uniform_int_distribution<std::int64_t> way(0, 3 * kMillisecond), wait(0, kSecond);
  std::uniform_real_distribution<double> drift(-ClockComparison::kMaxDrift,
                                               ClockComparison::kMaxDrift);
  for (int run = 0; run < 200; ++run) {
    ClockComparison clock;
    const double per_s = drift(random);
    const auto theirs = [&](std::int64_t own_ns) {
      return own_ns + 20 * kMillisecond + std::int64_t(per_s * double(own_ns));
    };
    std::int64_t now_ns = 0;
    for (int i = 0; i < 40; ++i) {
      const std::int64_t sent_ns = now_ns, there_ns = sent_ns + way(random),
                         leaves_ns = there_ns + wait(random), back_ns = leaves_ns + way(random);
      clock.add({sent_ns, theirs(there_ns), theirs(leaves_ns), back_ns});
      now_ns = back_ns + wait(random);
      const auto measured = clock.offset(now_ns);
      ASSERT_TRUE(measured);
      EXPECT_LE(std::abs(measured->offset_ns - (theirs(now_ns) - now_ns)), measured->error_ns)
          << "run " << run << ", exchange " << i;
    }
  }
}

TEST(ClockComparison, UsesTheExchangeWithTheSmallestErrorOfTheNewest) {
  ClockComparison clock;
  clock.add(exchange(0, kSecond, 5 * kMillisecond, 0, 5 * kMillisecond));
  clock.add(exchange(0, 2 * kSecond, 0, 0, 100'000));
  clock.add(exchange(0, 3 * kSecond, 5 * kMillisecond, 0, 5 * kMillisecond));
  EXPECT_LT(clock.offset(3 * kSecond)->error_ns, kMillisecond);
  for (std::size_t i = 0; i < ClockComparison::kExchanges; ++i)
    clock.add(exchange(0, 4 * kSecond, 5 * kMillisecond, 0, 5 * kMillisecond));
  EXPECT_GE(clock.offset(4 * kSecond)->error_ns, 5 * kMillisecond);
}

TEST(ClockComparison, TheErrorGrowsWithTheAge) {
  ClockComparison clock;
  clock.add(exchange(0, 0, kMillisecond, 0, kMillisecond));
  EXPECT_NEAR(double(clock.offset(100 * kSecond)->error_ns), 11e6, 1e3);
}

TEST(ClockComparison, AClockThatIsSetReplacesWhatWasMeasured) {
  ClockComparison clock;
  for (int i = 0; i < 8; ++i)
    clock.add(exchange(0, i * kSecond, kMillisecond / 10, 0, kMillisecond / 10));
  clock.add(exchange(50 * kMillisecond, 8 * kSecond, kMillisecond, 0, kMillisecond));
  EXPECT_EQ(clock.offset(8 * kSecond + 2 * kMillisecond)->offset_ns, 50 * kMillisecond);
}

// A peer can state any times.
TEST(ClockComparison, ImpossibleTimesAreIgnored) {
  constexpr std::int64_t kLeast = std::numeric_limits<std::int64_t>::min(),
                         kMost = std::numeric_limits<std::int64_t>::max();
  ClockComparison clock;
  clock.add({10, 0, 0, 5});    // arrived before it was sent
  clock.add({0, 10, 5, 20});   // answered before it arrived
  clock.add({0, 0, 100, 20});  // waited longer than the exchange took
  EXPECT_EQ(clock.offset(0), std::nullopt);
  for (const std::int64_t a : {kLeast, kMost})
    for (const std::int64_t b : {kLeast, kMost})
      for (const std::int64_t c : {kLeast, kMost}) clock.add({0, a, b, c});
  clock.add(exchange(0, 0, kMillisecond, 0, kMillisecond));
  EXPECT_EQ(clock.offset(2 * kMillisecond)->offset_ns, 0);
}

TEST(ClockVerdict, JudgesWhatTheOffsetIsAtLeast) {
  EXPECT_EQ(verdict_on({0, 0}), ClockVerdict::good);
  EXPECT_EQ(verdict_on({2 * kMillisecond, 0}), ClockVerdict::good);
  EXPECT_EQ(verdict_on({3 * kMillisecond, kMillisecond / 2}), ClockVerdict::warning);
  EXPECT_EQ(verdict_on({-3 * kMillisecond, kMillisecond / 2}), ClockVerdict::warning);
  EXPECT_EQ(verdict_on({3 * kMillisecond, 2 * kMillisecond}), ClockVerdict::good);
  EXPECT_EQ(verdict_on({20 * kMillisecond, 0}), ClockVerdict::warning);
  EXPECT_EQ(verdict_on({21 * kMillisecond, kMillisecond / 2}), ClockVerdict::refused);
  EXPECT_EQ(verdict_on({-2 * kSecond, kMillisecond}), ClockVerdict::refused);
  EXPECT_EQ(verdict_on({std::numeric_limits<std::int64_t>::min(), 0}), ClockVerdict::refused);
}

TEST(ClockOffset, AsText) {
  EXPECT_EQ(text_of(ClockOffset{150'000'000, 120'000}), "150.00 ms ahead (error at most 0.12 ms)");
  EXPECT_EQ(text_of(ClockOffset{-2'000'000'000, 1'500'000}),
            "2000.00 ms behind (error at most 1.50 ms)");
}

}  // namespace
}  // namespace fivepipe::launch
