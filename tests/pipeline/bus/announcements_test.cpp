#include "common/pipeline/bus/announce/announcements.h"

#include <gtest/gtest.h>

#include <string>

namespace fivepipe::bus::detail {
namespace {

using namespace std::chrono_literals;
using Clock = Announcements::Clock;

constexpr Clock::time_point kStart{};

// Calls take_due() at each time that next() returns. Returns how often it was true in this time.
int announcements_in(Announcements& announcements, Clock::time_point from, Clock::duration time) {
  int count = announcements.take_due(from);
  for (auto next = announcements.next(); next && *next < from + time; next = announcements.next())
    count += announcements.take_due(*next);
  return count;
}

TEST(Announcements, AreDueWhileAllProcessesOfAMachineAreMissing) {
  Announcements announcements("own", kStart);
  EXPECT_FALSE(announcements.take_due(kStart));
  EXPECT_EQ(announcements.next(), std::nullopt);
  announcements.found("1", "other");
  announcements.found("2", "other");
  announcements.found("3", "third");
  announcements.lost("1", kStart);
  EXPECT_FALSE(announcements.take_due(kStart)) << "another process of the machine is present";
  EXPECT_EQ(announcements.next(), std::nullopt);
  announcements.lost("2", kStart);
  EXPECT_TRUE(announcements.take_due(kStart));
  EXPECT_EQ(announcements.next(), kStart + Announcements::kPeriod);
  EXPECT_FALSE(announcements.take_due(kStart + Announcements::kPeriod - 1ms));
  EXPECT_TRUE(announcements.take_due(kStart + Announcements::kPeriod));
  announcements.found("4", "other");
  EXPECT_FALSE(announcements.take_due(kStart + 1s));
  EXPECT_EQ(announcements.next(), std::nullopt);
}

TEST(Announcements, EndAfterTheSearch) {
  Announcements announcements("own", kStart);
  announcements.found("1", "other");
  announcements.lost("1", kStart);
  EXPECT_EQ(announcements_in(announcements, kStart, 60s),
            Announcements::kSearch / Announcements::kPeriod + 1);
  EXPECT_EQ(announcements.next(), std::nullopt);
}

TEST(Announcements, AreNotDueForTheOwnMachineOrAnUnknownProcess) {
  Announcements announcements("own", kStart);
  announcements.found("1", "own");
  announcements.lost("1", kStart);
  announcements.lost("2", kStart);
  EXPECT_FALSE(announcements.take_due(kStart));
}

// A program on the other machine starts and ends once per second.
TEST(Announcements, AreLimitedToOnePerSecondAfterTheFirstHundred) {
  constexpr int kSeconds = 600;
  Announcements announcements("own", kStart);
  int count = 0;
  for (int second = 0; second < kSeconds; ++second) {
    const auto now = kStart + std::chrono::seconds(second);
    announcements.found(std::to_string(second), "other");
    announcements.lost(std::to_string(second), now);
    count += announcements_in(announcements, now, 1s);
  }
  EXPECT_LE(count, Announcements::kMaxAtOnce + kSeconds);
  EXPECT_GE(count, Announcements::kMaxAtOnce + kSeconds - 5);
}

TEST(Announcements, RememberABoundedNumberOfProcesses) {
  Announcements announcements("own", kStart);
  for (std::size_t i = 0; i < Announcements::kMaxRemembered; ++i)
    announcements.found(std::to_string(i), "other");
  announcements.found("further", "third");
  announcements.lost("further", kStart);
  EXPECT_FALSE(announcements.take_due(kStart)) << "it was not remembered";
}

TEST(Announcements, SearchABoundedNumberOfMachines) {
  Announcements announcements("own", kStart);
  const auto come_and_go = [&](std::size_t machine, Clock::time_point now) {
    announcements.found(std::to_string(machine), std::to_string(machine));
    announcements.lost(std::to_string(machine), now);
  };
  for (std::size_t i = 0; i < Announcements::kMaxRemembered; ++i) come_and_go(i, kStart);
  come_and_go(Announcements::kMaxRemembered, kStart + 10s);
  EXPECT_TRUE(announcements.take_due(kStart + 10s));
  EXPECT_FALSE(announcements.take_due(kStart + Announcements::kSearch + 5s))
      << "the further one is not searched for";
}

}  // namespace
}  // namespace fivepipe::bus::detail
