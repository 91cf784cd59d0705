#include "common/recording/replay/sent_tally.h"

#include <gtest/gtest.h>

namespace fivepipe::replay {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000, kRecorderStarts_ns = 1'700'000'000 * kSecond_ns;
const std::string kNode = "capture", kTopic = "maps";

// A node that sends 100 messages a second, of which some do not come, and a status twice a second.
class SentTallyTest : public testing::Test {
 protected:
  SentTally tally_{kRecorderStarts_ns};
  std::uint64_t sent_ = 0;

  static std::int64_t stamp(double s) {
    return kRecorderStarts_ns + std::int64_t(s * double(kSecond_ns));
  }
  void tell(double at_s, double start_s) {
    tally_.told({kNode, stamp(start_s), stamp(at_s), {{kTopic, sent_}}, false});
  }
  // From and to: seconds after the recorder's start. Heard: the recorder takes what comes.
  void run(double start_s, double from_s, double to_s, bool heard = true) {
    for (int i = int(from_s * 100); i < int(to_s * 100); ++i) {
      if (heard && i % 50 == 0) tell(0.01 * i, start_s);
      ++sent_;
      if (heard) tally_.received(kNode, kTopic, stamp(0.01 * i + 0.001));
    }
  }
  SentByNode only() const {
    const auto all = tally_.compared();
    EXPECT_EQ(all.size(), 1u);
    return all.empty() ? SentByNode{} : all.front();
  }
};

TEST_F(SentTallyTest, NothingIsMissingOfWhoIsHeardFromItsStart) {
  run(1, 1, 3);
  tell(3, 1);
  EXPECT_EQ(only().sent, 200u);
  EXPECT_EQ(only().received, 200u);
  EXPECT_TRUE(tally_.not_compared(stamp(4)).empty());
}

TEST_F(SentTallyTest, WhatIsMissingOfWhoStartedLaterIsCountedThoughItsFirstStatusesWereMissed) {
  run(1, 1, 2, false);
  run(1, 2, 3);
  tell(3, 1);
  EXPECT_EQ(only().missing(), 100u);
}

// The recorder came late, stood still for two seconds, and went on.
TEST_F(SentTallyTest, AStallOfARecorderThatCameLateIsNoticedToTheMessage) {
  run(-10, -10, 0, false);
  run(-10, 0, 2);
  run(-10, 2, 4, false);
  run(-10, 4, 6);
  tell(6, -10);
  // From the second status on, and a tenth of a second before it.
  EXPECT_EQ(only().sent, 550u);
  EXPECT_EQ(only().received, 360u);
  EXPECT_EQ(only().missing(), 190u);
}

TEST_F(SentTallyTest, ARecorderThatCameLateAndMissedNothingSaysSo) {
  run(-10, -10, 0, false);
  run(-10, 0, 3);
  tell(3, -10);
  EXPECT_EQ(only().missing(), 0u);
}

// Sent before the second status, and taken after it.
TEST_F(SentTallyTest, WhatWasOnItsWayDoesNotHideALoss) {
  run(-10, -10, 0, false);
  run(-10, 0, 0.6);
  for (int i = 0; i < 1000; ++i) tally_.received(kNode, kTopic, stamp(0.2));
  run(-10, 0.6, 2.6, false);
  tell(3, -10);
  EXPECT_EQ(only().missing(), 190u);
}

TEST_F(SentTallyTest, ARestartedProcessCountsFromZeroAgain) {
  run(1, 1, 2);
  tell(2, 1);
  sent_ = 0;
  run(3, 3, 4, false);
  run(3, 4, 5);
  tell(5, 3);
  EXPECT_EQ(only().sent, 300u);
  EXPECT_EQ(only().missing(), 100u);
}

TEST_F(SentTallyTest, WhoToldNothingOrOnlyOnceIsNamed) {
  tally_.received("silent", kTopic, stamp(1));
  run(-10, 0, 0.4);
  EXPECT_TRUE(tally_.compared().empty());
  EXPECT_EQ(tally_.not_compared(stamp(1)), (std::set<std::string>{"silent", kNode}));
}

TEST_F(SentTallyTest, WhoFellSilentWithoutAFinalStatusIsNamed) {
  run(1, 1, 3);
  EXPECT_EQ(tally_.not_compared(stamp(6)), std::set<std::string>{kNode});
  tally_.told({kNode, stamp(1), stamp(3), {{kTopic, sent_}}, true});
  EXPECT_TRUE(tally_.not_compared(stamp(6)).empty());
}

// Their stamps are those of the recording.
TEST_F(SentTallyTest, StatusesThatAReplaySendsAreNotRegarded) {
  sent_ = 500;
  tell(-100, -200);
  tell(-99, -200);
  EXPECT_TRUE(tally_.compared().empty());
}

}  // namespace
}  // namespace fivepipe::replay
