// The recorder as a library. tests/system/recording_test.cpp tests the process.
#include "common/recording/replay/recorder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "common/base/realtime.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "tests/support/process.h"
#include "tests/support/recording/synthetic_recordings.h"
#include "tests/support/test_domain.h"

namespace fivepipe::replay {
namespace {

using namespace std::chrono_literals;

// A peer that creates writers again and again must not end the recording.
TEST(Recorder, MessagesOfWritersWithoutAChannelAreLostAndTheReasonNamesAParticipant) {
  const std::string topic = bus::topics::FrameComposited::name;
  test::TestFolder folder;
  recording::RecordingWriter recording(folder.path / "full.mcap", "test", {});
  const std::uint32_t domain = test::own_domain();
  bus::Bus bus({domain}), peer({.domain = domain, .participant = "mallory"}),
      before({.domain = domain, .participant = "alice"}),
      after({.domain = domain, .participant = "zoe"});
  Recorder recorder(
      bus, recording,
      {{topic.c_str(), bus::topics::FrameComposited::type, bus::topics::FrameComposited::descriptor,
        bus::topics::FrameComposited::delivery, bus::topics::FrameComposited::max_keys}});
  auto first = peer.writer<bus::topics::FrameComposited>(),
       another = peer.writer<bus::topics::FrameComposited>(),
       second = peer.writer<bus::topics::FrameComposited>(),
       alices = before.writer<bus::topics::FrameComposited>(),
       zoes = after.writer<bus::topics::FrameComposited>();
  const auto is_matched = [](const auto& writer) { return writer.readers() == 1; };
  ASSERT_TRUE(test::eventually(bus, 10s, [&] {
    return is_matched(first) && is_matched(another) && is_matched(second) && is_matched(alices) &&
           is_matched(zoes);
  }));
  fivepipe_v1_FrameComposited message{};
  messages::set_text(message.viewer, "viewer");
  const auto received = [&](std::uint64_t count) {
    return test::eventually(bus, 10s, [&] {
      recorder.take();
      return recording.counts()[topic].received == count;
    });
  };
  first.write(message);
  another.write(message);
  alices.write(message);
  zoes.write(message);
  ASSERT_TRUE(received(4));
  const std::uint64_t message_bytes = recording.counts()[topic].bytes / 4;
  while (!recording.is_full()) recording.add_channel("other", "Type", "schema", {});
  second.write(message);
  second.write(message);
  ASSERT_TRUE(received(6));
  EXPECT_EQ(recording.counts()[topic].lost, 2u);
  EXPECT_EQ(recording.counts()[topic].bytes, 6 * message_bytes);
  EXPECT_EQ(recording.loss_reason(),
            std::string(recording::kFullReason) + ", of which 'mallory' uses 2");
  first.write(message);
  ASSERT_TRUE(received(7));
  recording.finish();
  EXPECT_EQ(recording.counts()[topic].written, 5u) << "those of the earlier writers";
}

// The limit is one of nodes that send a status, not of participants.
TEST(Recorder, ComparesANodeThatJoinsAfterManyParticipants) {
  const auto topic = bus::topics::described<bus::topics::FrameComposited>();
  test::TestFolder folder;
  recording::RecordingWriter recording(folder.path / "many.mcap", "test", {});
  const std::uint32_t domain = test::own_domain();
  bus::Bus bus({domain});
  Recorder recorder(bus, recording, {topic, bus::topics::described<bus::topics::HeadPose>()});
  const auto is_compared = [&](bus::Bus& from, const std::string& node) {
    auto writer = from.writer<bus::topics::NodeStatus>();
    fivepipe_v1_TopicCounts sent{};
    messages::set_text(sent.topic, topic.name);
    sent.sent = 1;
    fivepipe_v1_TopicCounts none{}, not_recorded{};
    messages::set_text(none.topic, bus::topics::HeadPose::name);
    messages::set_text(not_recorded.topic, bus::topics::HullTile::name);
    not_recorded.sent = 9;
    std::vector<fivepipe_v1_TopicCounts> topics{sent, none, not_recorded};
    fivepipe_v1_NodeStatus status{};
    messages::set_text(status.node, node);
    status.start_stamp_ns = base::now_realtime_ns();
    messages::borrow(status.topics, topics);
    return test::eventually(bus, 10s, [&] {
      writer.write(status);
      recorder.take();
      bool is_named = false;
      for (const SentByNode& sent_by : recorder.compared()) {
        EXPECT_EQ(sent_by.topic, topic.name);
        EXPECT_EQ(sent_by.sent, 1u);
        is_named |= sent_by.node == node;
      }
      return is_named;
    });
  };
  std::vector<std::unique_ptr<bus::Bus>> others;
  std::vector<bus::Writer<bus::topics::FrameComposited>> writers;
  for (std::size_t i = 0; i <= LossDetector::kMaxNodes; ++i) {
    others.push_back(std::make_unique<bus::Bus>(
        bus::BusOptions{.domain = domain, .participant = "other_" + std::to_string(i)}));
    writers.push_back(others.back()->writer<bus::topics::FrameComposited>());
  }
  EXPECT_TRUE(is_compared(*others.front(), "other_0"));
  bus::Bus late({.domain = domain, .participant = "late"});
  EXPECT_TRUE(is_compared(late, "late"));
  // A status of a node that does not exist, before one of a node that does.
  auto invents = late.writer<bus::topics::NodeStatus>();
  fivepipe_v1_NodeStatus invented{};
  messages::set_text(invented.node, "invented");
  invented.start_stamp_ns = base::now_realtime_ns();
  fivepipe_v1_TopicCounts sent{};
  messages::set_text(sent.topic, topic.name);
  sent.sent = 1;
  std::vector<fivepipe_v1_TopicCounts> sents{sent};
  messages::borrow(invented.topics, sents);
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return invents.readers() == 1; }));
  invents.write(invented);
  ASSERT_TRUE(invents.wait_for_delivery(10s));
  EXPECT_TRUE(is_compared(*others.back(), "other_" + std::to_string(LossDetector::kMaxNodes)));
  for (const SentByNode& sent_by : recorder.compared()) EXPECT_NE(sent_by.node, "invented");
}

}  // namespace
}  // namespace fivepipe::replay
