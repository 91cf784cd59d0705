#include "common/recording/replay/loss_detector.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/recording/synthetic_recordings.h"
#include "tests/support/time_units.h"

namespace fivepipe::replay {
namespace {

constexpr std::int64_t kRecorderStarts_ns = test::kStart_ns;
const std::string kNode = "capture", kTopic = "maps";

// Simulates a node that sends 100 messages and 2 statuses per second, and a recorder that misses
// some of them.
class LossDetectorTest : public testing::Test {
 protected:
  LossDetector loss_detector_{kRecorderStarts_ns};
  std::uint64_t sent_ = 0;

  static std::int64_t stamp(double s) {
    return kRecorderStarts_ns + std::int64_t(s * double(test::s));
  }
  void report(double at_s, double start_s) {
    loss_detector_.add_status({kNode, stamp(start_s), stamp(at_s), {{kTopic, sent_}}, false});
  }
  // Times are seconds after the recorder's start. `heard`: the recorder receives the messages.
  void run(double start_s, double from_s, double to_s, bool heard = true) {
    for (int i = int(from_s * 100); i < int(to_s * 100); ++i) {
      if (heard && i % 50 == 0) report(0.01 * i, start_s);
      ++sent_;
      if (heard) loss_detector_.received(kNode, kTopic, stamp(0.01 * i + 0.001));
    }
  }
  SentByNode only() const {
    const auto all = loss_detector_.compared();
    EXPECT_EQ(all.size(), 1u);
    return all.empty() ? SentByNode{} : all.front();
  }
};

TEST_F(LossDetectorTest, NothingIsMissingFromStart) {
  run(1, 1, 3);
  report(3, 1);
  EXPECT_EQ(only().sent, 200u);
  EXPECT_EQ(only().received, 200u);
  EXPECT_TRUE(loss_detector_.unverified_nodes(stamp(4)).empty());
}

TEST_F(LossDetectorTest, CountsLossesOfLateProcessDespiteMissedStatuses) {
  run(1, 1, 2, false);
  run(1, 2, 3);
  report(3, 1);
  EXPECT_EQ(only().missing(), 100u);
}

// The recorder starts after the node and receives nothing for two seconds.
TEST_F(LossDetectorTest, LateRecorderCountsLossesExactly) {
  run(-10, -10, 0, false);
  run(-10, 0, 2);
  run(-10, 2, 4, false);
  run(-10, 4, 6);
  report(6, -10);
  // Counts from 0.1 s before the second status.
  EXPECT_EQ(only().sent, 550u);
  EXPECT_EQ(only().received, 360u);
  EXPECT_EQ(only().missing(), 190u);
}

TEST_F(LossDetectorTest, LateRecorderWithoutLossesReportsNone) {
  run(-10, -10, 0, false);
  run(-10, 0, 3);
  report(3, -10);
  EXPECT_EQ(only().missing(), 0u);
}

// A recorder that starts after the node, and whose reader for the node's topic is matched later
// than the reader for its statuses.
class LateMatch : public LossDetectorTest {
 protected:
  // The recorder receives only the statuses at 0, 0.5, .. <= to_s. The second one is at 0.5.
  void run_unmatched(double to_s) {
    run(-10, -10, 0, false);
    for (double at_s = 0; at_s <= to_s; at_s += 0.5) {
      report(at_s, -10);
      run(-10, at_s, std::min(to_s, at_s + 0.5), false);
    }
  }
};

TEST_F(LateMatch, ComparesATopicFromTheStatusThatIsNewerThanItsFirstMessage) {
  run_unmatched(2.95);
  EXPECT_EQ(only().missing(), 200u) << "no message has arrived";
  run(-10, 2.95, 3.05);  // with a status at 3, less than 0.1 s after the first message
  EXPECT_TRUE(loss_detector_.compared().empty());
  EXPECT_EQ(loss_detector_.unverified_nodes(stamp(3.05)), std::set<std::string>{kNode});
  run(-10, 3.05, 4);
  report(4, -10);
  EXPECT_TRUE(loss_detector_.unverified_nodes(stamp(4)).empty());
  EXPECT_EQ(only().missing(), 0u);
  EXPECT_EQ(only().received, 60u) << "from 0.1 s before the status at 3.5";
  run(-10, 4, 5, false);
  report(5, -10);
  // 100 were lost, but 10 of the 0.1 s before the status at 3.5 were received, and it counts them.
  EXPECT_EQ(only().missing(), 90u);
}

// The first message is sent 9.95 s after the second status. The status from which the topic is
// compared is sent 10.5 s after it.
TEST_F(LateMatch, ComparesATopicWhoseFirstMessageIsSentAfterNearlyTenSeconds) {
  run_unmatched(10.45);
  run(-10, 10.45, 11.5);
  report(11.5, -10);
  EXPECT_EQ(only().missing(), 0u);
  EXPECT_EQ(only().received, 60u);
}

TEST_F(LateMatch, ComparesATopicThatBeginsAfterTenSecondsFromTheSecondStatus) {
  run_unmatched(10.55);
  run(-10, 10.55, 11.5);
  report(11.5, -10);
  EXPECT_EQ(only().received, 95u);
  EXPECT_EQ(only().missing(), 1005u) << "all of 10.05 s since the second status";
}

TEST_F(LateMatch, ComparesATopicThatNeverArrivesFromTheSecondStatus) {
  run_unmatched(30);
  EXPECT_EQ(only().missing(), 2950u);
}

// A process replaces the one that ran before the recorder, before or after the first message of the
// topic. What the first process sent until then is no loss.
TEST_F(LateMatch, ComparesATopicFromTheStartOfTheProcessThatReplacesTheFirst) {
  for (const bool has_arrived : {false, true}) {
    loss_detector_ = LossDetector(kRecorderStarts_ns);
    sent_ = 0;
    run_unmatched(2.95);
    if (has_arrived) run(-10, 2.95, 3.05);
    sent_ = 0;
    run(4, 4, 6);
    loss_detector_.received(kNode, "poses", stamp(6.1));  // of a topic that arrives later
    report(6.2, 4);
    EXPECT_EQ(only().sent, 200u) << has_arrived;
    EXPECT_EQ(only().received, 200u) << has_arrived;
    EXPECT_TRUE(loss_detector_.unverified_nodes(stamp(6.2)).empty()) << has_arrived;
  }
}

// Messages sent before the second status and received after it.
TEST_F(LossDetectorTest, MessagesInTransitDoNotHideLosses) {
  run(-10, -10, 0, false);
  run(-10, 0, 0.6);
  for (int i = 0; i < 1000; ++i) loss_detector_.received(kNode, kTopic, stamp(0.2));
  run(-10, 0.6, 2.6, false);
  report(3, -10);
  EXPECT_EQ(only().missing(), 190u);
}

TEST_F(LossDetectorTest, ARestartedProcessCountsFromZeroAgain) {
  run(1, 1, 2);
  report(2, 1);
  sent_ = 0;
  run(3, 3, 4, false);
  run(3, 4, 5);
  report(5, 3);
  EXPECT_EQ(only().sent, 300u);
  EXPECT_EQ(only().missing(), 100u);
}

TEST_F(LossDetectorTest, ListsNodesWithTooFewStatuses) {
  loss_detector_.received("silent", kTopic, stamp(1));
  run(-10, 0, 0.4);
  EXPECT_TRUE(loss_detector_.compared().empty());
  EXPECT_EQ(loss_detector_.unverified_nodes(stamp(1)), (std::set<std::string>{"silent", kNode}));
}

TEST_F(LossDetectorTest, ListsNodesWithoutFinalStatus) {
  run(1, 1, 3);
  EXPECT_EQ(loss_detector_.unverified_nodes(stamp(6)), std::set<std::string>{kNode});
  loss_detector_.add_status({kNode, stamp(1), stamp(3), {{kTopic, sent_}}, true});
  EXPECT_TRUE(loss_detector_.unverified_nodes(stamp(6)).empty());
}

TEST_F(LossDetectorTest, AStatusIsCurrentForTwoSeconds) {
  run(1, 1, 3);
  loss_detector_.add_status({kNode, stamp(1), stamp(3), {{kTopic, sent_}}});
  EXPECT_TRUE(loss_detector_.unverified_nodes(stamp(5) - 1).empty());
  EXPECT_EQ(loss_detector_.unverified_nodes(stamp(5)), std::set<std::string>{kNode});
}

TEST_F(LossDetectorTest, TheRecordersStartBelongsToTheComparison) {
  report(0, 0);
  sent_ = 1;
  loss_detector_.received(kNode, kTopic, stamp(0.1));
  report(0.2, 0);
  EXPECT_EQ(only().sent, 1u);
  EXPECT_EQ(only().received, 1u);
}

TEST_F(LossDetectorTest, MessagesBeforeTheFirstStatusOfANewProcessCount) {
  ++sent_;
  loss_detector_.received(kNode, kTopic, stamp(1.1));
  report(1.2, 1);
  EXPECT_EQ(only().sent, 1u);
  EXPECT_EQ(only().received, 1u);
}

// A late process is compared from 0.1 s before its second status on.
TEST_F(LossDetectorTest, TheFirstComparedStampIsExact) {
  report(0, -10);
  for (const int at_ns : {-1, 0, 1}) loss_detector_.received(kNode, kTopic, stamp(0.5) + at_ns);
  report(0.6, -10);
  EXPECT_EQ(loss_detector_.compared().size(), 1u);
  EXPECT_EQ(only().received, 2u);
  // Messages that were in transit when the status arrived.
  for (const int at_ns : {-1, 0, 1}) loss_detector_.received(kNode, kTopic, stamp(0.5) + at_ns);
  EXPECT_EQ(only().received, 4u);
}

TEST_F(LossDetectorTest, AProcessThatSentOneStatusOnlyIsComparedFromItsSuccessor) {
  sent_ = 500;
  report(0, -10);
  for (int i = 0; i < 5; ++i) loss_detector_.received(kNode, kTopic, stamp(0.2));
  sent_ = 0;
  run(1, 1, 2);
  report(2, 1);
  EXPECT_EQ(only().sent, 100u);
  EXPECT_EQ(only().received, 100u);
}

TEST(SentByNode, MissesNoMessageThatItReceivedTwice) {
  EXPECT_EQ(SentByNode{}.missing(), 0u);
  EXPECT_EQ(SentByNode{}.received, 0u);
  EXPECT_EQ((SentByNode{"node", "topic", 5, 3}).missing(), 2u);
  EXPECT_EQ((SentByNode{"node", "topic", 3, 5}).missing(), 0u);
}

// Replayed statuses have the stamps of the recording.
TEST_F(LossDetectorTest, IgnoresReplayedStatuses) {
  sent_ = 500;
  report(-100, -200);
  report(-99, -200);
  EXPECT_TRUE(loss_detector_.compared().empty());
}

// Otherwise a peer that invents nodes, or start times of processes, fills the memory.
TEST_F(LossDetectorTest, InventedNodesAndProcessesAreIgnored) {
  run(1, 1, 3);
  for (int i = 0; i < 2000; ++i) {
    const std::string invented = "invented_" + std::to_string(i);
    loss_detector_.add_status({invented, stamp(1), stamp(1), {{kTopic, 5}}, false});
    loss_detector_.received(invented, kTopic, stamp(1));
  }
  report(3, 1);
  EXPECT_EQ(loss_detector_.compared().size(), 256u);
  for (const SentByNode& by : loss_detector_.compared()) {
    EXPECT_EQ(by.missing(), by.node == kNode ? 0u : 4u) << by.node;
  }
  LossDetector starts{kRecorderStarts_ns};
  for (int i = 0; i < 2000; ++i)
    starts.add_status({kNode, stamp(1 + i), stamp(1 + i), {{kTopic, 1}}, false});
  EXPECT_EQ(starts.compared().at(0).sent, 64u);
}

TEST_F(LossDetectorTest, ListsThatFurtherNodesAreNotCompared) {
  for (std::size_t i = 0; i < LossDetector::kMaxNodes; ++i)
    loss_detector_.received("node_" + std::to_string(i), kTopic, stamp(1));
  EXPECT_FALSE(loss_detector_.unverified_nodes(stamp(1)).contains(LossDetector::kFurtherNodes));
  loss_detector_.received("one more", kTopic, stamp(1));
  EXPECT_TRUE(loss_detector_.unverified_nodes(stamp(1)).contains(LossDetector::kFurtherNodes));
}

// A process that ran before sends one status and then messages only.
TEST_F(LossDetectorTest, StampsOfLateProcessAreBounded) {
  run(-10, -10, 0, false);
  report(0, -10);
  for (std::size_t i = 0; i < 2 * LossDetector::kMaxStamps; ++i)
    loss_detector_.received(kNode, kTopic, stamp(0.2 + 1e-6 * double(i)));
  sent_ += 2 * LossDetector::kMaxStamps;
  report(0.3, -10);
  EXPECT_EQ(only().received, 65536u);
}

}  // namespace
}  // namespace fivepipe::replay
