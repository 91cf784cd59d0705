#include "common/recording/replay/in_flight_tracker.h"

#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <sstream>
#include <stdexcept>

#include "common/pipeline/messages/wire_conversions.h"
#include "tests/support/process.h"
#include "tests/support/test_domain.h"

namespace fivepipe::replay {
namespace {

using namespace std::chrono_literals;

bool is_tile(const recording::OwnedMessage& message) {
  return message.channel->topic == bus::topics::HullTile::name && !message.key_change;
}

const char* const kRecording = FIVEPIPE_SOURCE_DIR "/tests/recordings/v1.mcap";

// The first frame of the recording that has all its tiles.
recording::FrameGroup frame_with_tiles(const recording::Recording& recording) {
  recording::FrameGroups groups(recording, recording.messages(), [](const auto&) { return 0; });
  while (auto group = groups.next())
    if (std::any_of(group->messages.begin(), group->messages.end(), is_tile)) return *group;
  throw std::runtime_error("the recording has no tile");
}

// render_node shows only frames of which it has all tiles.
TEST(InFlightTracker, WaitsForRenderedFramesOnlyIfAllTilesAreSent) {
  bus::Bus bus({test::own_domain()});
  const recording::Recording recording(kRecording);
  ReplayPlan plan;
  plan.nodes = {{"parent", "render_node"}};
  const recording::FrameGroup whole = frame_with_tiles(recording);
  const auto is_waited_for = [&](const recording::FrameGroup& group) {
    InFlightTracker tracker(bus, recording, plan, {bus::topics::HullTile::name});
    tracker.reset();
    tracker.expect(group);
    EXPECT_EQ(tracker.expected().at("parent"), tracker.is_waited_for(*group.frame) ? 1u : 0u);
    return tracker.is_waited_for(*group.frame);
  };
  EXPECT_TRUE(is_waited_for(whole));
  recording::FrameGroup incomplete = whole;
  incomplete.messages.erase(
      std::find_if(incomplete.messages.begin(), incomplete.messages.end(), is_tile));
  EXPECT_FALSE(is_waited_for(incomplete));
  std::erase_if(incomplete.messages, is_tile);
  EXPECT_FALSE(is_waited_for(incomplete));
}

// Benchmarks subtract the stamps of a trace.
TEST(InFlightTracker, RefusesAndLogsTracesWithImpossibleStamps) {
  std::ostringstream log;
  const auto logger = spdlog::default_logger();
  spdlog::set_default_logger(std::make_shared<spdlog::logger>(
      "test", std::make_shared<spdlog::sinks::ostream_sink_mt>(log)));
  bus::Bus bus({test::own_domain()});
  auto writer = bus.writer<bus::topics::FrameTrace>();
  const recording::Recording recording(kRecording);
  ReplayPlan plan;
  plan.lossless = true;
  plan.nodes = {{"simulation", "sim_node"}};
  InFlightTracker tracker(bus, recording, plan, {});
  tracker.reset();
  std::vector<std::uint64_t> frames;
  tracker.on_trace = [&](const fivepipe_v1_FrameTrace& trace) { frames.push_back(trace.frame); };
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return writer.readers() == 1; }));
  const auto send = [&](std::uint64_t frame, std::int64_t first_input_ns) {
    fivepipe_v1_FrameTrace trace{};
    messages::set_text(trace.node, "simulation");
    trace.frame = frame;
    trace.first_input_ns = trace.last_input_ns = first_input_ns;
    writer.write(trace);
  };
  send(1, INT64_MIN);
  send(2, 1);
  EXPECT_TRUE(test::eventually(bus, 10s, [&] {
    tracker.take_traces();
    return !frames.empty();
  }));
  spdlog::set_default_logger(logger);
  EXPECT_EQ(frames, std::vector<std::uint64_t>{2});
  EXPECT_NE(log.str().find("dropped: bad_trace: simulation: "), std::string::npos) << log.str();
  EXPECT_NE(log.str().find("(1 so far)"), std::string::npos) << log.str();
}

}  // namespace
}  // namespace fivepipe::replay
