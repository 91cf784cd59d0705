#include "common/recording/replay/in_flight_tracker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>
#include <thread>

#include "common/pipeline/messages/wire_conversions.h"
#include "tests/support/captured_log.h"
#include "tests/support/process.h"
#include "tests/support/recording/kept_recording.h"
#include "tests/support/test_domain.h"

namespace fivepipe::replay {
namespace {

using namespace std::chrono_literals;

bool is_tile(const recording::OwnedMessage& message) {
  return message.channel->topic == bus::topics::HullTile::name && !message.key_change;
}

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
  const recording::Recording recording(test::kKeptRecording);
  ReplayPlan plan;
  plan.nodes = {{"parent", "render_node"}};
  plan.nodes.front().hull_views = {"viewer"};
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

// With shadows, a frame also has the tiles of the light's view; with two eyes, those of both.
TEST(InFlightTracker, WaitsForRenderedFramesOnlyIfTheyHaveAllViews) {
  bus::Bus bus({test::own_domain()});
  const recording::Recording recording(test::kKeptRecording);
  ReplayPlan plan;
  plan.nodes = {{"parent", "render_node"}};
  plan.nodes.front().hull_views = {"viewer", "mirror"};
  const auto is_waited_for = [&](const recording::FrameGroup& group) {
    InFlightTracker tracker(bus, recording, plan, {bus::topics::HullTile::name});
    tracker.reset();
    tracker.expect(group);
    return tracker.is_waited_for(*group.frame);
  };
  recording::FrameGroup group = frame_with_tiles(recording);
  EXPECT_FALSE(is_waited_for(group));
  // The same tiles of a view whose name has the same length.
  const std::string viewer = "viewer", other = "mirror";
  const std::vector<recording::OwnedMessage> of_viewer = group.messages;
  for (recording::OwnedMessage message : of_viewer) {
    if (!is_tile(message)) continue;
    const auto at = std::search(message.cdr.begin(), message.cdr.end(), viewer.begin(),
                                viewer.end(), [](std::byte a, char b) { return char(a) == b; });
    ASSERT_NE(at, message.cdr.end());
    std::transform(other.begin(), other.end(), at, [](char c) { return std::byte(c); });
    group.messages.push_back(std::move(message));
  }
  EXPECT_TRUE(is_waited_for(group));
  // render_node ignores the tiles of other views.
  plan.nodes.front().hull_views = {"mirror"};
  EXPECT_TRUE(is_waited_for(group));
  group.messages.pop_back();
  EXPECT_FALSE(is_waited_for(group));
}

// The kept recording has one eye.
TEST(InFlightTracker, NamesTheViewsOfARecordingWithAnotherNumberOfEyes) {
  const test::CapturedLog captured;
  bus::Bus bus({test::own_domain()});
  const recording::Recording recording(test::kKeptRecording);
  ReplayPlan plan;
  plan.nodes = {{"parent", "render_node"}};
  plan.nodes.front().hull_views = {"viewer/left", "viewer/right"};
  InFlightTracker tracker(bus, recording, plan, {bus::topics::HullTile::name});
  tracker.reset();
  const recording::FrameGroup group = frame_with_tiles(recording);
  for (int i = 0; i < 2; ++i) tracker.expect(group);
  EXPECT_EQ(tracker.expected().at("parent"), 0u);
  const std::string log = captured.text(),
                    expected =
                        "the recording has tiles of the views viewer, the deployment has the views "
                        "viewer/left, viewer/right\n";
  ASSERT_NE(log.find(expected), std::string::npos) << log;
  EXPECT_EQ(log.find(expected, log.find(expected) + 1), std::string::npos) << "once is enough";
}

// Groups of messages without content.
class InFlightTrackerTest : public testing::Test {
 protected:
  using Group = recording::FrameGroup;
  static recording::RecordedChannel channel_of(const char* topic) {
    recording::RecordedChannel channel;
    channel.topic = topic;
    return channel;
  }
  static Group group(std::optional<std::uint64_t> frame, std::size_t maps, std::size_t poses) {
    static const auto map = channel_of(bus::topics::ObjectPixelMap::name),
                      pose = channel_of(bus::topics::HeadPose::name);
    Group made{.frame = frame, .log_stamp_ns = 0, .capture_stamp_ns = 0, .messages = {}};
    made.messages.resize(maps + poses);
    for (std::size_t i = 0; i < maps + poses; ++i)
      made.messages[i].channel = i < maps ? &map : &pose;
    return made;
  }
  InFlightTrackerTest() {
    plan_.nodes = {{"S", "sim_node"}, {"R", "recon_node"}, {"V", "render_node"}};
    plan_.shape_cameras = 2;
  }
  InFlightTracker tracker(std::chrono::milliseconds timeout = 60s) {
    plan_.timeout = timeout;
    InFlightTracker made(bus_, recording_, plan_, {bus::topics::ObjectPixelMap::name});
    made.reset();
    return made;
  }
  // Nodes for which the group is complete.
  std::string complete_for(const Group& group) {
    InFlightTracker tracker = this->tracker();
    tracker.expect(group);
    std::string names;
    for (const auto& [name, count] : tracker.expected())
      if (count > 0) names += name;
    EXPECT_EQ(group.frame && tracker.is_waited_for(*group.frame), !names.empty());
    return names;
  }

  bus::Bus bus_{{.domain = test::own_domain()}};
  const recording::Recording recording_{test::kKeptRecording};
  ReplayPlan plan_;
};

TEST_F(InFlightTrackerTest, FrameSetsNeedAllMapsOfOneRunAndAPoseUnlessForSimulation) {
  EXPECT_EQ(complete_for(group(7, 2, 0)), "S");
  EXPECT_EQ(complete_for(group(7, 2, 1)), "RSV");
  EXPECT_EQ(complete_for(group(7, 1, 1)), "");
  EXPECT_EQ(complete_for(group(7, 3, 1)), "");
  EXPECT_EQ(complete_for(group(std::nullopt, 2, 1)), "");
  Group changed = group(7, 2, 1);
  changed.messages[0].key_change = recording::KeyChange::disposed;
  EXPECT_EQ(complete_for(changed), "");
  changed = group(7, 3, 2);
  changed.messages[1].key_change = changed.messages[4].key_change = recording::KeyChange::disposed;
  EXPECT_EQ(complete_for(changed), "RSV") << "key changes belong to no set";
  // Two runs of one capture_node, and two capture_nodes.
  recording::RecordedChannel before = channel_of(bus::topics::ObjectPixelMap::name), after = before;
  before.node = after.node = "capture";
  before.writer = "1";
  after.writer = "2";
  changed = group(7, 2, 1);
  changed.messages[0].channel = &before;
  changed.messages[1].channel = &after;
  EXPECT_EQ(complete_for(changed), "");
  after.node = "capture_b";
  EXPECT_EQ(complete_for(changed), "RSV");
  after = before;
  EXPECT_EQ(complete_for(changed), "RSV");
  plan_.shape_cameras = 1;
  EXPECT_EQ(complete_for(group(7, 1, 1)), "RSV");
  plan_.shape_cameras = 0;
  EXPECT_EQ(complete_for(group(7, 0, 1)), "");
}

TEST_F(InFlightTrackerTest, CountsTheOpenFramesOfTheBusiestNode) {
  InFlightTracker tracker = this->tracker();
  EXPECT_EQ(tracker.max_open_frames(), 0u);
  EXPECT_FALSE(tracker.is_waited_for(7));
  tracker.expect(group(7, 2, 0));
  EXPECT_EQ(tracker.max_open_frames(), 1u);
  tracker.expect(group(8, 2, 1));
  EXPECT_EQ(tracker.max_open_frames(), 2u) << "of the simulation";
  EXPECT_TRUE(tracker.is_waited_for(7));
  EXPECT_FALSE(tracker.is_waited_for(9));
  EXPECT_EQ(tracker.expected(),
            (std::map<std::string, std::uint64_t>{{"R", 1}, {"S", 2}, {"V", 1}}));
  EXPECT_EQ(tracker.handled(),
            (std::map<std::string, std::uint64_t>{{"R", 0}, {"S", 0}, {"V", 0}}));
  EXPECT_EQ(tracker.stalled(0), "") << "long before the time-out";
  tracker.reset();
  EXPECT_EQ(tracker.max_open_frames(), 0u);
  EXPECT_EQ(tracker.expected().at("S"), 0u);
}

TEST_F(InFlightTrackerTest, NamesTheOldestFrameOfAStalledNode) {
  InFlightTracker tracker = this->tracker(-3s);  // has always passed
  EXPECT_EQ(tracker.stalled(0), "");
  tracker.expect(group(8, 2, 0));
  tracker.expect(group(7, 2, 0));
  EXPECT_EQ(tracker.stalled(1), "node 'S' has not handled frame 7 in -3 s");
  EXPECT_EQ(tracker.stalled(2), "");
}

TEST_F(InFlightTrackerTest, AFurtherFrameDoesNotProlongTheWaitForAStalledNode) {
  InFlightTracker tracker = this->tracker(50ms);
  tracker.expect(group(7, 2, 0));
  std::this_thread::sleep_for(60ms);
  tracker.expect(group(8, 2, 0));
  EXPECT_NE(tracker.stalled(1), "");
}

// Nodes publish traces, at a cost, only while a reader exists.
TEST_F(InFlightTrackerTest, ReadsTracesOnlyOfTheNodesOfALosslessReplay) {
  const auto reads = [&](bool lossless, bool with_nodes) {
    ReplayPlan plan = plan_;
    plan.lossless = lossless;
    if (!with_nodes) plan.nodes.clear();
    InFlightTracker tracker(bus_, recording_, plan, {});
    tracker.reset();
    tracker.take_traces();
    const auto endpoints = bus_.endpoints();
    return std::any_of(endpoints.begin(), endpoints.end(), [](const auto& endpoint) {
      return endpoint.own && !endpoint.writes && endpoint.topic == bus::topics::FrameTrace::name;
    });
  };
  EXPECT_FALSE(reads(false, true));
  EXPECT_FALSE(reads(true, false));
  EXPECT_TRUE(reads(true, true));
}

TEST_F(InFlightTrackerTest, ATraceHandlesTheOpenFrameOfItsNodeOnce) {
  plan_.lossless = true;
  InFlightTracker tracker = this->tracker();
  auto writer = bus_.writer<bus::topics::FrameTrace>();
  ASSERT_TRUE(test::eventually(bus_, 10s, [&] { return writer.readers() == 1; }));
  std::vector<std::string> traced;
  const auto send = [&](const char* node, std::uint64_t frame, std::int64_t last_input_ns = 1,
                        std::int64_t step_start_ns = 1, std::int64_t step_end_ns = 1) {
    fivepipe_v1_FrameStep step{};
    step.start_ns = step_start_ns;
    step.end_ns = step_end_ns;
    std::vector<fivepipe_v1_FrameStep> steps{step};
    fivepipe_v1_FrameTrace trace{};
    messages::set_text(trace.node, node);
    trace.frame = frame;
    trace.last_input_ns = last_input_ns;
    messages::borrow(trace.steps, steps);
    writer.write(trace);
  };
  // Traces of one key arrive in their order, so the last one has arrived after all others.
  const auto take_until = [&](const std::string& last) {
    return test::eventually(bus_, 10s, [&] {
      tracker.take_traces();
      return !traced.empty() && traced.back() == last;
    });
  };
  tracker.expect(group(7, 2, 1));
  send("S", 7);  // without a listener
  ASSERT_TRUE(test::eventually(bus_, 10s, [&] {
    tracker.take_traces();
    return tracker.handled().at("S") == 1;
  }));
  tracker.on_trace = [&](const fivepipe_v1_FrameTrace& trace) {
    traced.push_back(trace.node + std::to_string(trace.frame));
  };
  tracker.expect(group(8, 2, 1));
  send("stranger", 8);
  send("S", 7);
  send("S", 8, -1);
  send("S", 8, 1, -1);
  send("S", 8, 1, 1, -1);
  send("S", 99);
  ASSERT_TRUE(take_until("S99"));
  EXPECT_EQ(traced, (std::vector<std::string>{"S7", "S99"}));
  EXPECT_EQ(tracker.handled().at("S"), 1u);
  EXPECT_EQ(tracker.max_open_frames(), 2u) << "of the other nodes";
  EXPECT_TRUE(tracker.is_waited_for(8));
  send("S", 8);
  ASSERT_TRUE(take_until("S8"));
  EXPECT_EQ(tracker.handled(),
            (std::map<std::string, std::uint64_t>{{"R", 0}, {"S", 2}, {"V", 0}}));
  // Traces of an earlier round are discarded.
  tracker.expect(group(9, 2, 0));
  send("S", 9);
  ASSERT_TRUE(bus_.wait(10s));
  tracker.reset();
  tracker.expect(group(9, 2, 0));
  tracker.expect(group(10, 2, 0));
  send("S", 10);
  ASSERT_TRUE(take_until("S10"));
  EXPECT_EQ(tracker.handled().at("S"), 1u);
  EXPECT_TRUE(tracker.is_waited_for(9));
}

// Benchmarks subtract the stamps of a trace.
TEST(InFlightTracker, RefusesAndLogsTracesWithImpossibleStamps) {
  const test::CapturedLog captured;
  bus::Bus bus({test::own_domain()});
  auto writer = bus.writer<bus::topics::FrameTrace>();
  const recording::Recording recording(test::kKeptRecording);
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
  send(1, INT64_MIN);
  send(2, 1);
  EXPECT_TRUE(test::eventually(bus, 10s, [&] {
    tracker.take_traces();
    return !frames.empty();
  }));
  const std::string log = captured.text();
  EXPECT_EQ(frames, std::vector<std::uint64_t>{2});
  EXPECT_NE(log.find("dropped: bad_trace: simulation: "), std::string::npos) << log;
  EXPECT_NE(log.find("(1 so far)"), std::string::npos) << log;
  EXPECT_EQ(log.find("(2 so far)"), std::string::npos) << "at most one line per 5 s";
}

}  // namespace
}  // namespace fivepipe::replay
