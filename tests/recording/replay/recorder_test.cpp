// The recorder as a library. tests/system/recording_test.cpp tests the process.
#include "common/recording/replay/recorder.h"

#include <gtest/gtest.h>

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
        bus::topics::FrameComposited::delivery}});
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

}  // namespace
}  // namespace fivepipe::replay
