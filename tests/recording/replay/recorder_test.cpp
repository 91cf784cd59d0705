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
  bus::Bus bus({domain}), peer({.domain = domain, .participant = "mallory"});
  Recorder recorder(
      bus, recording,
      {{topic.c_str(), bus::topics::FrameComposited::type, bus::topics::FrameComposited::descriptor,
        bus::topics::FrameComposited::delivery, bus::topics::FrameComposited::max_keys}});
  auto first = peer.writer<bus::topics::FrameComposited>(),
       second = peer.writer<bus::topics::FrameComposited>();
  ASSERT_TRUE(
      test::eventually(bus, 10s, [&] { return first.readers() == 1 && second.readers() == 1; }));
  fivepipe_v1_FrameComposited message{};
  messages::set_text(message.viewer, "viewer");
  const auto received = [&](std::uint64_t count) {
    return test::eventually(bus, 10s, [&] {
      recorder.take();
      return recording.counts()[topic].received == count;
    });
  };
  first.write(message);
  ASSERT_TRUE(received(1));
  while (!recording.is_full()) recording.add_channel("other", "Type", "schema", {});
  second.write(message);
  second.write(message);
  ASSERT_TRUE(received(3));
  EXPECT_EQ(recording.counts()[topic].lost, 2u);
  EXPECT_NE(recording.loss_reason().find("'mallory' uses 1"), std::string::npos)
      << recording.loss_reason();
  first.write(message);
  ASSERT_TRUE(received(4));
  recording.finish();
  EXPECT_EQ(recording.counts()[topic].written, 2u) << "those of the first writer";
}

// The limit is one of nodes that send a status, not of participants.
TEST(Recorder, ComparesANodeThatJoinsAfterManyParticipants) {
  const auto topic = bus::topics::described<bus::topics::FrameComposited>();
  test::TestFolder folder;
  recording::RecordingWriter recording(folder.path / "many.mcap", "test", {});
  const std::uint32_t domain = test::own_domain();
  bus::Bus bus({domain});
  Recorder recorder(bus, recording, {topic});
  const auto is_compared = [&](bus::Bus& from, const std::string& node) {
    auto writer = from.writer<bus::topics::NodeStatus>();
    fivepipe_v1_TopicCounts sent{};
    messages::set_text(sent.topic, topic.name);
    sent.sent = 7;
    std::vector<fivepipe_v1_TopicCounts> topics{sent};
    fivepipe_v1_NodeStatus status{};
    messages::set_text(status.node, node);
    status.start_stamp_ns = base::now_realtime_ns();
    messages::borrow(status.topics, topics);
    return test::eventually(bus, 10s, [&] {
      writer.write(status);
      recorder.take();
      const auto compared = recorder.compared();
      return std::any_of(compared.begin(), compared.end(),
                         [&](const SentByNode& sent_by) { return sent_by.node == node; });
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
}

}  // namespace
}  // namespace fivepipe::replay
