// A real sim_node moves a part as messages request, or as a replay states.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>

#include "tests/support/not_finite.h"
#include "tests/support/scripted/capture.h"

namespace fivepipe::test {
namespace {

struct PartState {
  std::uint64_t frame;
  double x_m;
};
PartState state_of(const bus::Sample<bus::topics::VirtualState>& sample) {
  for (const auto& object : messages::span_of(sample->objects))
    if (object.object == std::string("part"))
      return {sample->frame, object.world_from_object.translation_m.x};
  return {sample->frame, HUGE_VAL};
}

struct PartVerdict {
  std::uint64_t frame;
  bool collides;
};
PartVerdict verdict_of(const bus::Sample<bus::topics::CollisionResult>& sample) {
  return {sample->frame, sample->verdict == fivepipe_v1_colliding};
}

struct PartSpacing {
  std::string object;
  std::uint64_t frame;
  std::int64_t capture_stamp_ns;
  double spacing_m;
  bool requested;
  bool operator==(const PartSpacing&) const = default;
};
PartSpacing spacing_of(const bus::Sample<bus::topics::ObjectSpacing>& sample) {
  return {sample->object, sample->frame, sample->capture_stamp_ns, sample->spacing_m,
          sample->requested};
}

// The real ball has a radius of 9 cm and is near the origin. The part touches it below a spacing of
// about 17 cm.
class SimNodeSpacing : public ScriptedCapture {
 protected:
  bus::Writer<bus::topics::SpacingRequest> requests_ = bus_.writer<bus::topics::SpacingRequest>();
  Collected<bus::topics::VirtualState, PartState> states_{bus_, state_of};
  Collected<bus::topics::CollisionResult, PartVerdict> verdicts_{bus_, verdict_of};
  Collected<bus::topics::ObjectSpacing, PartSpacing> spacings_{bus_, spacing_of};

  void start_node(const std::vector<std::string>& more = {}) {
    start("sim_node", "simulation",
          three_cameras(R"(
name: layout
objects:
  - {name: part, box: {size_m: [0.1, 0.1, 0.1]}, position_m: [0.3, 0, 0],
     spacing: {axis: [2, 0, 0], at_m: 0.4, range_m: [0.1, 0.5]}}
  - {name: still, box: {size_m: [0.1, 0.1, 0.1]}, position_m: [0, 0, -5], reaction: none}
)",
                        "  - {name: simulation, program: sim_node}\n"),
          more);
    wait_for_readers(infos_, maps_, requests_);
  }
  fivepipe_v1_ObjectSpacing recorded_spacing(std::uint64_t frame, double spacing_m) const {
    fivepipe_v1_ObjectSpacing message{};
    messages::set_text(message.object, "part");
    message.frame = frame;
    message.capture_stamp_ns = stamp_of(frame);
    message.spacing_m = spacing_m;
    return message;
  }
  void request(double spacing_m, const std::string& object = "part") {
    deliver(requests_, request_of(spacing_m, object));
  }
  static fivepipe_v1_SpacingRequest request_of(double spacing_m, const std::string& object) {
    fivepipe_v1_SpacingRequest request{};
    messages::set_text(request.object, object);
    request.spacing_m = spacing_m;
    return request;
  }
  // Sends the frame and waits until the node has handled it. Returns the part's x in it [m].
  double simulate(std::uint64_t frame) {
    send_maps(frame);
    EXPECT_TRUE(holds([&] {
      states_.take();
      return !traces().empty() && traces().back().frame == frame && !states_.all().empty() &&
             states_.all().back().frame == frame;
    })) << said();
    return states_.all().back().x_m;
  }
  bool collides(std::uint64_t frame) {
    const auto of_frame = [&](const PartVerdict& verdict) { return verdict.frame == frame; };
    EXPECT_TRUE(holds([&] { return std::ranges::any_of(verdicts_.take(), of_frame); }));
    return std::ranges::find_if(verdicts_.all(), of_frame)->collides;
  }
  bool has_spacings(std::size_t count) {
    return holds([&] { return spacings_.take().size() >= count; });
  }
};

TEST_F(SimNodeSpacing, RequestsMoveThePartFromTheNextFrameOn) {
  start_node();
  EXPECT_NEAR(simulate(0), 0.3, 1e-12);
  EXPECT_FALSE(collides(0));
  ASSERT_TRUE(has_spacings(1)) << said();
  EXPECT_EQ(spacings_.all()[0], (PartSpacing{"part", 0, stamp_of(0), 0.4, false}));
  request(0.12);
  EXPECT_NEAR(simulate(1), 0.02, 1e-12);
  EXPECT_TRUE(collides(1));
  request(0.3);
  request(0.45);
  EXPECT_NEAR(simulate(2), 0.35, 1e-12) << "the last request counts";
  EXPECT_FALSE(collides(2));
  EXPECT_NEAR(simulate(3), 0.35, 1e-12);
  ASSERT_TRUE(has_spacings(3)) << said();
  EXPECT_EQ(spacings_.all()[1], (PartSpacing{"part", 1, stamp_of(1), 0.12, true}));
  EXPECT_EQ(spacings_.all()[2], (PartSpacing{"part", 2, stamp_of(2), 0.45, true}));
  // A reader that joins later receives the present one.
  Collected<bus::topics::ObjectSpacing, PartSpacing> late(bus_, spacing_of);
  ASSERT_TRUE(holds([&] { return !late.take().empty(); }));
  EXPECT_EQ(late.all()[0], spacings_.all()[2]);
  EXPECT_TRUE(ended().drops.empty());
  EXPECT_EQ(spacings_.take().size(), 3u) << "none without a change";
}

// As `fivepipe up` does at a restart.
TEST_F(SimNodeSpacing, TheFirstFrameHasTheSpacingOfTheCommandLine) {
  start_node(
      {"--spacing", "part", "0.12", "--spacing", "still", "0.1", "--spacing", "gone", "0.1"});
  EXPECT_NEAR(simulate(0), 0.02, 1e-12);
  EXPECT_TRUE(collides(0));
  ASSERT_TRUE(has_spacings(1)) << said();
  EXPECT_EQ(spacings_.all()[0], (PartSpacing{"part", 0, stamp_of(0), 0.12, true}));
  request(0.4);
  EXPECT_NEAR(simulate(1), 0.3, 1e-12);
  const NodeReport report = ended();
  EXPECT_EQ(drops_of(report, "bad_spacing"), 2u);
  EXPECT_EQ(report.drops.at("bad_spacing: still: has no spacing"), 1u);
  EXPECT_EQ(report.drops.at("bad_spacing: gone: not in the scene"), 1u);
}

TEST_F(SimNodeSpacing, TheCommandLineMovesNothingInASceneWithoutSpacings) {
  start("sim_node", "simulation",
        three_cameras(R"(
name: still
objects:
  - {name: still, box: {size_m: [0.1, 0.1, 0.1]}, position_m: [0, 0, -5], reaction: none}
)",
                      "  - {name: simulation, program: sim_node}\n"),
        {"--spacing", "still", "0.1"});
  wait_for_readers(infos_, maps_);
  simulate(0);
  EXPECT_EQ(ended().drops.at("bad_spacing: still: has no spacing"), 1u);
}

TEST_F(SimNodeSpacing, BadRequestsAreDroppedAndCounted) {
  start_node();
  simulate(0);
  for (const double bad : {0.0999, 0.5001}) request(bad);
  for (const double bad : {kNaN, kInfinity, -kInfinity}) request(bad);
  request(0.2, "still");
  request(0.2, "unknown");
  EXPECT_NEAR(simulate(1), 0.3, 1e-12);
  bus::Bus stranger({.domain = domain_, .deployment = "other"});
  auto requests = stranger.writer<bus::topics::SpacingRequest>();
  // The node may discover the writer later than the writer discovers the node.
  ASSERT_TRUE(holds([&] {
    deliver(requests, request_of(0.12, "part"));
    return drops_of(report(), "other_deployment") > 0;
  })) << said();
  EXPECT_NEAR(simulate(2), 0.3, 1e-12);
  const NodeReport report = ended();
  EXPECT_EQ(drops_of(report, "bad_spacing"), 7u);
  EXPECT_EQ(report.drops.at("bad_spacing: part: 0.5001 m is outside of range_m [0.1, 0.5]"), 1u);
  EXPECT_EQ(report.drops.at("bad_spacing: still: has no spacing"), 1u);
  EXPECT_EQ(report.drops.at("bad_spacing: unknown: not in the scene"), 1u);
  EXPECT_EQ(spacings_.take().size(), 1u);
}

// The replay sends a frame's spacing before its maps, and may send those of several frames at once.
TEST_F(SimNodeSpacing, AReplayMovesThePartInExactlyTheRecordedFrames) {
  auto recorded = bus_.writer<bus::topics::ObjectSpacing>();
  start_node();
  wait_for_readers(recorded);
  begin_replay(true);
  const auto record = [&](std::uint64_t frame, double spacing_m) {
    deliver(recorded, recorded_spacing(frame, spacing_m));
  };
  record(0, 0.2);
  record(2, 0.12);
  record(3, 0.5);
  record(4, 0.6);  // outside of the range
  request(0.3);    // a request during a replay
  for (const auto& [frame, x_m] : {std::pair{0, 0.1}, {1, 0.1}, {2, 0.02}, {3, 0.4}, {4, 0.4}})
    EXPECT_NEAR(simulate(std::uint64_t(frame)), x_m, 1e-12) << frame;
  // The replay begins again.
  begin_replay(true);
  EXPECT_NEAR(simulate(0), 0.3, 1e-12);
  end_replay();
  const NodeReport report = ended();
  EXPECT_EQ(drops_of(report, "bad_spacing"), 1u);
  EXPECT_EQ(report.sent.at(bus::topics::ObjectSpacing::name), 0u) << "the replay has sent them";
}

// A node that is busy takes the replay's session and its first spacings at once.
TEST_F(SimNodeSpacing, AReplayMovesThePartAlsoIfTheNodeIsBusyWhenItBegins) {
  auto recorded = bus_.writer<bus::topics::ObjectSpacing>();
  auto sessions = bus_.writer<bus::topics::ReplaySession>();
  start_node();
  wait_for_readers(recorded, sessions);
  fivepipe_v1_ReplaySession session{};
  messages::set_text(session.replay, "script");
  session.lossless = true;
  simulate(0);
  std::uint64_t frame = 0;
  for (const double spacing_m : {0.2, 0.12, 0.3, 0.25, 0.15}) {
    at_once([&] {
      deliver(sessions, session);
      deliver(recorded, recorded_spacing(++frame, spacing_m));
    });
    EXPECT_NEAR(simulate(frame), spacing_m - 0.1, 1e-12);
  }
  // One that arrives before the session belongs to an earlier replay.
  at_once([&] {
    deliver(recorded, recorded_spacing(++frame, 0.5));
    deliver(sessions, session);
  });
  EXPECT_NEAR(simulate(frame), 0.3, 1e-12) << "as in the scene";
}

}  // namespace
}  // namespace fivepipe::test
