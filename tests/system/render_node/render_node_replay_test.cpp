// Which state render_node waits for, how long, and what a replay changes.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "common/base/realtime.h"
#include "common/pipeline/node/status_names.h"
#include "tests/support/sanitizer.h"
#include "tests/system/render_node/render_node_fixture.h"

namespace fivepipe::test {
namespace {

constexpr std::int64_t kMillisecond_ns = 1'000'000;

// In a lossless replay the node waits for 2 s, so the delays of a busy machine do not matter.
TEST_F(RenderNode, WaitsForTheStateOfTheSameFrame) {
  start_with(", video: false, still_frame: 3");
  begin_replay(true);
  for (const std::uint64_t frame : {1, 2}) {
    send_state(frame, -0.3);
    send_hull(frame);
  }
  ASSERT_TRUE(has_composited(2)) << said();
  send_hull(3);
  // The node reports this state of another frame after it has taken the hull.
  send_state(2, 0, "ball", 7);
  ASSERT_TRUE(holds([&] { return drops_of(report(), "bad_state") == 1; })) << said();
  EXPECT_EQ(composited_.take().size(), 2u) << "composited without its state";
  const std::int64_t sent_ns = base::now_realtime_ns();
  send_state(3, 0.3);
  ASSERT_TRUE(has_composited(3)) << said();
  EXPECT_GE(composited_.all()[2].composited_stamp_ns, sent_ns);
  const cv::Mat image = still();
  EXPECT_TRUE(has_ball_at(image, 0.3));
  EXPECT_FALSE(has_ball_at(image, -0.3));
  EXPECT_EQ(drops_of(ended(), "late_state"), 0u);
}

// 40 ms, and 2 s in a lossless replay. The node cannot wait for a shorter time than from the test's
// write to the composite. On a busy machine it may wait longer; the shortest of five waits may not.
TEST_F(RenderNode, CompositesWithThePreviousStateAfterTheTimeout) {
  start_with(", video: false, still_frame: 5");
  send_state(0, -0.3);
  double shortest_ms = 1e9;
  for (std::uint64_t frame = 1; frame <= 5; ++frame) {
    deliver(tiles_, tile(frame, 0).wire());
    const std::int64_t sent_ns = base::now_realtime_ns();
    deliver(tiles_, tile(frame, 1).wire());
    ASSERT_TRUE(has_composited(frame)) << said();
    shortest_ms = std::min(shortest_ms,
                           1e-6 * double(composited_.all().back().composited_stamp_ns - sent_ns));
    ASSERT_GE(shortest_ms, 40);
  }
  EXPECT_LT(shortest_ms, 100 * kSlowdown);
  EXPECT_TRUE(has_ball_at(still(), -0.3));
  begin_replay(true);
  send_state(6, 0);
  const std::int64_t sent_ns = base::now_realtime_ns();
  send_hull(7);
  ASSERT_TRUE(has_composited(6)) << said();
  EXPECT_GE(composited_.all().back().composited_stamp_ns - sent_ns, 2000 * kMillisecond_ns);
  EXPECT_LT(composited_.all().back().composited_stamp_ns - sent_ns,
            kSlowdown * 4000 * kMillisecond_ns);
  EXPECT_EQ(ended().drops.at("late_state"), 6u);
}

TEST_F(RenderNode, CompositesAtOnceWithoutASimulation) {
  start_with(", video: false", false);
  double shortest_ms = 1e9;
  for (std::uint64_t frame = 1; frame <= 5; ++frame) {
    const std::int64_t sent_ns = base::now_realtime_ns();
    send_hull(frame);
    ASSERT_TRUE(has_composited(frame)) << said();
    shortest_ms = std::min(shortest_ms,
                           1e-6 * double(composited_.all().back().composited_stamp_ns - sent_ns));
  }
  EXPECT_LT(shortest_ms, 40 * kSlowdown);
  EXPECT_EQ(drops_of(ended(), "late_state"), 0u);
}

TEST_F(RenderNode, ANewerHullReplacesOneThatWaitsForItsState) {
  start_with(", video: false, still_frame: 2");
  send_state(0, -0.3);
  send_state(2, 0.3);
  // Both hulls are complete before the node can have waited for 40 ms, or it composites the first
  // one by its timeout: the result is the same.
  send_hull(1);
  send_hull(2);
  ASSERT_TRUE(has_composited(2)) << said();
  EXPECT_EQ(composited_frames(), (std::vector<std::uint64_t>{1, 2}));
  EXPECT_TRUE(has_ball_at(still(), 0.3));
  EXPECT_EQ(ended().drops.at("late_state"), 1u);
}

TEST_F(RenderNode, EachHullOfALosslessReplayWaitsForItsState) {
  start_with(", video: false, still_frame: 2");
  begin_replay(true);
  for (const std::uint64_t frame : {1, 2, 3}) send_hull(frame);
  send_state(1, -0.2);
  ASSERT_TRUE(has_composited(1)) << said();
  // The node takes the other two hulls together, and then this state of an earlier frame.
  send_state(1, 0, "ball", 7);
  ASSERT_TRUE(holds([&] { return drops_of(report(), "bad_state") == 1; })) << said();
  for (const std::uint64_t frame : {2, 3}) send_state(frame, 0.2 * double(frame) - 0.4);
  ASSERT_TRUE(has_composited(3)) << said();
  EXPECT_EQ(composited_frames(), (std::vector<std::uint64_t>{1, 2, 3}));
  EXPECT_TRUE(has_ball_at(still(), 0));
  EXPECT_EQ(drops_of(ended(), "late_state"), 0u);
}

// Two recon_nodes send whole frames; start_with() closes the last entry.
const std::string kRoundRobin =
    "}\n  - {name: recon_a, program: recon_node, split: frames, worker: 0, workers: 2}\n  - {name: "
    "recon_b, program: recon_node, split: frames, worker: 1, workers: 2";

// The node knows of frame 2 from its state.
TEST_F(RenderNode, AnOvertakenHullOfALosslessReplayIsCompositedInItsPlace) {
  start_with(", video: false, still_frame: 2" + kRoundRobin);
  begin_replay(true);
  for (const std::uint64_t frame : {1, 2, 3}) send_state(frame, 0.2 * double(frame) - 0.4);
  send_hull(1);
  ASSERT_TRUE(has_composited(1)) << said();
  deliver(tiles_, tile(2, 0).wire());
  send_hull(3);
  wait_until_taken();
  EXPECT_EQ(composited_.take().size(), 1u) << "frame 3 before frame 2";
  deliver(tiles_, tile(2, 1).wire());
  ASSERT_TRUE(has_composited(3)) << said();
  EXPECT_EQ(composited_frames(), (std::vector<std::uint64_t>{1, 2, 3}));
  EXPECT_TRUE(has_ball_at(still(), 0));
  const NodeReport report = ended();
  EXPECT_EQ(drops_of(report, "incomplete_hull"), 0u);
  EXPECT_EQ(drops_of(report, "late_tile"), 0u);
}

// Frame 1 has a state, but its hull arrives after the 2 s for which frame 2 waits. Frames of the
// past do not stop the node: frame 3 may be that of a peer.
TEST_F(RenderNode, AnOvertakenHullOfALosslessReplayMayArriveTooLate) {
  start_with(", video: false" + kRoundRobin);
  begin_replay(true);
  for (const std::uint64_t frame : {1, 2}) send_state(frame);
  const std::int64_t sent_ns = base::now_realtime_ns();
  send_hull(2);
  ASSERT_TRUE(has_composited(1)) << said();
  EXPECT_GE(composited_.all()[0].composited_stamp_ns - sent_ns, 2000 * kMillisecond_ns);
  send_hull(1);
  send_state(100);
  send_hull(100);
  ASSERT_TRUE(has_composited(2)) << said();
  EXPECT_EQ(composited_frames(), (std::vector<std::uint64_t>{2, 100}));
  EXPECT_TRUE(holds([&] { return drops_of(report(), "incomplete_hull") > 0; })) << said();
  for (std::uint64_t frame = 3; frame < 3 + 16; ++frame) {
    send_state(frame);
    send_hull(frame);
    wait_until_taken();
  }
  ASSERT_TRUE(has_composited(3)) << said();
  EXPECT_EQ(composited_frames().back(), 18u);
}

// A replay of nodes that divide each frame waits for no hull: frame 1 was never recorded.
TEST_F(RenderNode, OfDividedFramesNoneIsAwaited) {
  start_with(", video: false");
  begin_replay(true);
  for (const std::uint64_t frame : {1, 2}) send_state(frame);
  const std::int64_t sent_ns = base::now_realtime_ns();
  send_hull(2);
  ASSERT_TRUE(has_composited(1)) << said();
  EXPECT_LT(composited_.all()[0].composited_stamp_ns - sent_ns, 2000 * kMillisecond_ns);
}

// The replay's frames have lower numbers and earlier stamps than those before.
TEST_F(RenderNode, AReplayDiscardsTheFramesBeforeIt) {
  start_with(", video: false, still_frame: 0");
  for (std::uint64_t frame = 100; frame < 120; ++frame) send_state(frame, -0.3);
  send_hull(118);
  ASSERT_TRUE(has_composited(1)) << said();
  deliver(tiles_, tile(119, 0).wire());
  wait_until_taken();
  std::filesystem::remove(out_ / "composite.png");
  begin_replay(true);
  send_state(1, 0.3);
  send_hull(1);
  ASSERT_TRUE(has_composited(2)) << said();
  deliver(tiles_, tile(119, 1).wire());
  send_state(2, 0.1);
  send_hull(2);
  ASSERT_TRUE(has_composited(3)) << said();
  EXPECT_EQ(composited_frames(), (std::vector<std::uint64_t>{118, 1, 2}));
  const NodeReport report = ended();
  EXPECT_EQ(drops_of(report, "late_state"), 0u);
  EXPECT_EQ(drops_of(report, "late_tile"), 0u);
  EXPECT_EQ(report.drops.at("incomplete_hull"), 1u);
}

TEST_F(RenderNode, AReplayDiscardsTheHullsThatWaitForTheirStates) {
  start_with(", video: false");
  begin_replay(true);
  // Frame 50 waits for its state. Meanwhile two more hulls arrive, which the node takes together.
  for (const std::uint64_t frame : {50, 51, 52}) send_hull(frame);
  send_state(50);
  ASSERT_TRUE(has_composited(1)) << said();
  send_state(50, 0, "ball", 7);
  ASSERT_TRUE(holds([&] { return drops_of(report(), "bad_state") == 1; })) << said();
  begin_replay(true);
  // The node may take the first one before it has noticed the replay, but not the second.
  for (const std::uint64_t refused : {2, 3}) {
    send_state(50, 0, "ball", 7);
    ASSERT_TRUE(holds([&] { return drops_of(report(), "bad_state") == refused; })) << said();
  }
  for (const std::uint64_t frame : {1, 2}) {
    send_state(frame);
    send_hull(frame);
    ASSERT_TRUE(has_composited(frame + 1)) << said();
  }
  EXPECT_EQ(composited_frames(), (std::vector<std::uint64_t>{50, 1, 2}));
  EXPECT_EQ(drops_of(ended(), "late_state"), 0u);
}

// A busy node finds messages from before a replay together with the replay's own. It also leaves
// hulls on the bus while a frame of a lossless replay waits.
TEST_F(RenderNode, AReplayDiscardsTheHullsOnTheBus) {
  start_with(", video: false");
  begin_replay(true);
  send_state(50);
  send_hull(50);
  ASSERT_TRUE(has_composited(1)) << said();
  at_once([&] {
    send_hull(52);
    begin_replay(true);
    send_state(1);
    send_hull(1);
  });
  ASSERT_TRUE(has_composited(2)) << said();
  send_state(2);
  send_hull(2);
  ASSERT_TRUE(has_composited(3)) << said();
  EXPECT_EQ(composited_frames(), (std::vector<std::uint64_t>{50, 1, 2}));
  const NodeReport report = ended();
  EXPECT_EQ(drops_of(report, "late_state"), 0u);
  EXPECT_EQ(drops_of(report, "late_tile"), 0u);
}

TEST_F(RenderNode, AReplayDiscardsTheResultsOfTheSimulationOnTheBus) {
  start_with(", video: false, still_frame: 1");
  begin_replay(true);
  at_once([&] {
    send_collision(1, "touched", fivepipe_v1_colliding);
    send_particle(1, 0);
    send_state(1, -0.3);
    begin_replay(true);
    send_collision(1, "met", fivepipe_v1_colliding);
    send_state(1, 0.3);
    send_hull(1);
  });
  ASSERT_TRUE(has_composited(1)) << said();
  const cv::Mat image = still();
  EXPECT_TRUE(has_ball_at(image, 0.3));
  EXPECT_FALSE(is_blue_at(image, 0));
  EXPECT_EQ(red_boxes(image), (std::set<std::string>{"met"}));
}

// Frame 6 of the replay has the number and the timestamp of a frame before the replay.
TEST_F(RenderNode, AReplayDiscardsTheStatesBeforeIt) {
  start_with(", video: false, still_frame: 6");
  begin_replay(true);
  send_state(5, -0.3);
  send_state(6, -0.3);
  send_hull(5);
  ASSERT_TRUE(has_composited(1)) << said();
  begin_replay(true);
  send_hull(6);
  EXPECT_TRUE(reports_again()) << said();  // less than the 2 s for which the hull waits
  send_state(6, 0.3);
  ASSERT_TRUE(has_composited(2)) << said();
  EXPECT_TRUE(has_ball_at(still(), 0.3));
}

// A replay's captures are long ago.
TEST_F(RenderNode, LatencyOfAReplayBeginsAtTheArrival) {
  start_with(", video: false");
  begin_replay(false);
  send_state(1);
  deliver(tiles_, tile(1, 0).wire());
  wait_until_taken();
  const std::int64_t first_ns = base::now_realtime_ns();
  deliver(tiles_, tile(1, 1).wire());
  ASSERT_TRUE(has_composited(1)) << said();
  ASSERT_TRUE(holds([&] { return traces().size() == 1; }));
  EXPECT_LE(traces()[0].first_input_ns, first_ns);
  EXPECT_GE(traces()[0].last_input_ns, first_ns);
  const NodeReport report = ended();
  EXPECT_FALSE(report.latencies.contains(node::kCaptureToComposite));
  const auto& latency = report.latencies.at(node::kArrivalToComposite);
  EXPECT_EQ(latency.count, 1u);
  EXPECT_NEAR(latency.max_ms,
              1e-6 * double(composited_.all()[0].composited_stamp_ns - traces()[0].first_input_ns),
              0.01);  // float
}

}  // namespace
}  // namespace fivepipe::test
