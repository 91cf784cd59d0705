// How the pipeline benchmark splits the time of a frame into stages, and checks them from outside.
#include "benchmarks/nodes/pipeline/pipeline_breakdown.h"

#include <gtest/gtest.h>

#include <random>

#include "benchmarks/nodes/pipeline/outside_times.h"
#include "common/base/timing.h"
#include "common/pipeline/bus/topics.h"
#include "tests/support/time_units.h"

namespace fivepipe::node_bench {
namespace {

using test::ms;

const PipelineNodes kNodes{{"a", "b"}, "sim", "render", ""};
const PipelineNodes kNodesWithCapture{{"a", "b"}, "sim", "render", "capture"};

double of_stage(const FrameStages& stages, const std::string& name) {
  for (const auto& [stage, time_ms] : stages)
    if (stage == name) return time_ms;
  ADD_FAILURE() << "no stage " << name;
  return -1;
}

// Frames with random times in a possible order. No two of a frame's events coincide.
std::vector<replay::FrameTimes> random_frames(unsigned seed, int count) {
  std::mt19937 random(seed);
  const auto some = [&] { return std::int64_t(1 + random() % (5 * ms)); };
  std::vector<replay::FrameTimes> frames;
  std::int64_t now = 1000 * ms;
  std::map<std::string, std::int64_t> free;
  for (int i = 0; i < count; ++i) {
    replay::FrameTimes frame;
    frame.frame = std::uint64_t(2 * i);
    const std::int64_t captured = now + some();
    frame.sent.start_ns = captured;
    frame.sent.end_ns = captured + some();
    frame.nodes["capture"] = {
        0, 0, {{"capture", now + 1, captured}, {"publish", captured, frame.sent.end_ns}}};
    now = frame.sent.end_ns;
    std::int64_t tiles = 0;
    for (const char* name : {"a", "b"}) {
      const std::int64_t last = frame.sent.end_ns + some(),
                         start = std::max(last, free[name]) + some(), made = start + some(),
                         written = made + some();
      frame.nodes[name] = {
          last - 1, last, {{"reconstruct", start, made}, {"write_tiles", made, written}}};
      tiles = std::max(tiles, written);
      free[name] = written;
    }
    const std::int64_t simulated = frame.sent.end_ns + some() + some();
    frame.nodes["sim"] = {
        frame.sent.end_ns, frame.sent.end_ns, {{"simulate", frame.sent.end_ns, simulated}}};
    const std::int64_t taken = tiles + some() / 10,
                       start = std::max({taken, simulated, free["render"]}) + some(),
                       end = start + some();
    frame.nodes["render"] = {taken - 1, taken, {{"render", start, end}}};
    frame.composited_ns = end;
    frame.composite_received_ns = end + ms;
    free["render"] = end;
    frames.push_back(frame);
  }
  return frames;
}

TEST(PipelineBreakdown, StagesSumToMeasuredLatency) {
  for (const PipelineNodes& nodes : {kNodes, kNodesWithCapture})
    for (unsigned seed = 0; seed < 50; ++seed) {
      const PipelineBreakdown breakdown = breakdown_of(random_frames(seed, 40), nodes);
      ASSERT_EQ(breakdown.latency.size(), 40u);
      EXPECT_NEAR(breakdown.stages_mean_ms(), base::mean(breakdown.latency), 1e-9) << seed;
      EXPECT_NEAR(breakdown.explained_fraction(),
                  breakdown.stages_mean_ms() / (breakdown.stages_mean_ms() + 1), 1e-9);
      for (const auto& [stage, times] : breakdown.stages) {
        ASSERT_EQ(times.size(), 40u) << stage;
        for (const double time : times) EXPECT_GE(time, 0) << stage;
      }
    }
}

TEST(PipelineBreakdown, FollowsSlowestReconstructionNode) {
  std::vector<replay::FrameTimes> frames = random_frames(3, 1);
  auto& slow = frames[0].nodes["b"];
  slow.steps.back().end_ns += 100 * ms;
  const std::int64_t end = slow.steps.back().end_ns;
  frames[0].nodes["render"] = {end, end, {{"render", end, end + ms}}};
  frames[0].composited_ns = end + ms;
  const PipelineBreakdown breakdown = breakdown_of(frames, kNodes);
  EXPECT_GT(of_stage(breakdown.by_frame.at(0), "write_tiles"), 99);
  EXPECT_EQ(breakdown.waited_for_state, 0u);
}

// Two frames whose nodes are idle: the second one's times are changed by the tests below.
std::vector<replay::FrameTimes> two_frames() {
  std::vector<replay::FrameTimes> frames;
  for (const std::int64_t t : {1000 * ms, 2000 * ms}) {
    replay::FrameTimes frame;
    frame.frame = std::uint64_t(t / ms);
    frame.sent = {t, t, t + 2 * ms};
    for (const char* name : {"a", "b"})
      frame.nodes[name] = {
          t + 3 * ms,
          t + 4 * ms,
          {{"reconstruct", t + 5 * ms, t + 9 * ms}, {"write_tiles", t + 9 * ms, t + 12 * ms}}};
    frame.nodes["sim"] = {t + 3 * ms, t + 3 * ms, {{"simulate", t + 3 * ms, t + 6 * ms}}};
    frame.nodes["render"] = {t + 13 * ms, t + 13 * ms, {{"render", t + 15 * ms, t + 20 * ms}}};
    frame.composited_ns = t + 20 * ms;
    frame.composite_received_ns = t + 21 * ms;
    frames.push_back(frame);
  }
  return frames;
}
FrameStages second_of(const std::vector<replay::FrameTimes>& frames) {
  return breakdown_of(frames, kNodes).by_frame.at(2000);
}

TEST(PipelineBreakdown, AttributesEachStage) {
  const FrameStages stages = second_of(two_frames());
  const std::pair<const char*, double> expected[] = {
      {stage::kSend, 2},         {stage::kReconBusy, 0},   {stage::kReconBus, 2},
      {stage::kReconInputs, 1},  {stage::kReconstruct, 4}, {stage::kWriteTiles, 3},
      {stage::kRenderBusy, 0},   {stage::kRenderBus, 1},   {stage::kSimulation, 0},
      {stage::kRenderInputs, 2}, {stage::kRender, 5}};
  for (const auto& [name, time_ms] : expected)
    EXPECT_DOUBLE_EQ(of_stage(stages, name), time_ms) << name;
  EXPECT_EQ(stages.size(), std::size(expected));
}

TEST(PipelineBreakdown, QueueingAtABusyNodeIsNotBusTime) {
  auto frames = two_frames();
  frames[0].nodes["render"].steps.back().end_ns = 2012 * ms + ms / 2;
  const FrameStages stages = second_of(frames);
  EXPECT_DOUBLE_EQ(of_stage(stages, stage::kRenderBusy), 0.5);
  EXPECT_DOUBLE_EQ(of_stage(stages, stage::kRenderBus), 0.5);
}

// A node that takes the inputs of two frames at once finishes the first one before it begins.
TEST(PipelineBreakdown, NodeWithInputsOfTwoFramesIsBusyWithTheFirst) {
  auto frames = two_frames();
  frames[0].nodes["a"].steps.back().end_ns = frames[0].nodes["b"].steps.back().end_ns =
      2004 * ms + ms / 2;
  frames[0].nodes["render"].steps.back().end_ns = 2014 * ms;
  const FrameStages stages = second_of(frames);
  EXPECT_DOUBLE_EQ(of_stage(stages, stage::kReconBusy), 2.5);
  EXPECT_DOUBLE_EQ(of_stage(stages, stage::kReconBus), 0);
  EXPECT_DOUBLE_EQ(of_stage(stages, stage::kReconInputs), 0.5);
  EXPECT_DOUBLE_EQ(of_stage(stages, stage::kRenderBusy), 2);
  EXPECT_DOUBLE_EQ(of_stage(stages, stage::kRenderInputs), 1);
}

TEST(PipelineBreakdown, WritingEndsWhenTheReaderHasTheMessage) {
  auto frames = two_frames();
  frames[1].sent.end_ns = 2004 * ms + ms / 2;  // recon has its maps at 2004 ms
  frames[1].nodes["render"].last_input_ns = 2011 * ms;
  const FrameStages stages = second_of(frames);
  EXPECT_DOUBLE_EQ(of_stage(stages, stage::kSend), 4);
  EXPECT_DOUBLE_EQ(of_stage(stages, stage::kReconInputs), 1);
  EXPECT_DOUBLE_EQ(of_stage(stages, stage::kWriteTiles), 2);
  EXPECT_DOUBLE_EQ(of_stage(stages, stage::kRenderInputs), 4);
}

TEST(PipelineBreakdown, WaitsForTheSimulationUntilItsState) {
  auto frames = two_frames();
  frames[1].nodes["sim"].steps.back().end_ns = 2014 * ms;
  const FrameStages stages = second_of(frames);
  EXPECT_DOUBLE_EQ(of_stage(stages, stage::kSimulation), 1);
  EXPECT_DOUBLE_EQ(of_stage(stages, stage::kRenderInputs), 1);
}

// The messages on the wire as nodes send them whose account is `frames`. `b` also sends TileCosts.
std::map<std::uint64_t, wire::FrameMessages> messages_of(
    const std::vector<replay::FrameTimes>& frames) {
  using namespace bus::topics;
  std::map<std::uint64_t, wire::FrameMessages> by_frame;
  for (const replay::FrameTimes& frame : frames) {
    wire::FrameMessages& messages = by_frame[frame.frame];
    messages[{FrameTrace::name, "capture", ""}] = {frame.sent.end_ns + 1, frame.sent.end_ns + 1};
    for (const char* name : {"a", "b"}) {
      const replay::FrameAtNode& here = frame.nodes.at(name);
      messages[{HeadPose::name, "capture", name}] = {frame.sent.start_ns, frame.sent.start_ns};
      messages[{ObjectPixelMap::name, "capture", name}] = {frame.sent.start_ns + 1,
                                                           frame.sent.end_ns};
      messages[{HullTile::name, name, "render"}] = {here.steps[0].end_ns, here.steps[1].end_ns};
    }
    const std::int64_t made = frame.nodes.at("b").steps[0].end_ns;
    messages[{TileCosts::name, "b", "capture"}] = {made, made};
    messages[{HullTile::name, "b", "render"}].first_ns += 1;
    // The map for the simulation, which is not on the path, is sent last.
    messages[{ObjectPixelMap::name, "capture", "sim"}] = {frame.sent.start_ns + 1,
                                                          frame.sent.end_ns + ms / 2};
    const std::int64_t state = frame.nodes.at("sim").steps[0].end_ns;
    // The state of a frame may be sent again.
    messages[{VirtualState::name, "sim", "render"}] = {state, state + 100 * ms};
    messages[{FrameComposited::name, "render", ""}] = {frame.composited_ns, frame.composited_ns};
    messages[{FrameComposited::name, "render", "capture"}] = {frame.composited_ns + ms,
                                                              frame.composited_ns + ms};
  }
  return by_frame;
}

TEST(OutsideTimes, EqualACorrectAccount) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const auto frames = random_frames(seed, 30);
    for (const PipelineNodes& nodes : {kNodes, kNodesWithCapture}) {
      const auto stages = compared(breakdown_of(frames, nodes).by_frame,
                                   outside_stages(messages_of(frames), nodes, 0));
      ASSERT_EQ(stages.size(), nodes.capture.empty() ? 8u : 9u);
      EXPECT_EQ(stages.back().stage, "all stages");
      for (const StageAgreement& stage : stages) {
        EXPECT_EQ(stage.own_ms.size(), stage.stage == "capture" ? 29u : 30u) << stage.stage;
        EXPECT_NEAR(stage.means_ms().own_ms, stage.means_ms().outside_ms, 1e-5) << stage.stage;
        EXPECT_TRUE(stage.agrees()) << stage.stage;
      }
    }
  }
}

// Each part of an account that is off by 0.5 ms in every frame: the two stages beside the wrong
// boundary differ, and no other.
TEST(OutsideTimes, DifferFromAWrongAccount) {
  constexpr std::int64_t kOff = ms / 2;
  const auto right = two_frames();
  struct Case {
    std::function<void(replay::FrameTimes&)> change;
    std::vector<std::string> differ;
  };
  const std::string recon = "bus to reconstruction + reconstruction reads its inputs + reconstruct",
                    render = "bus to rendering + rendering reads its inputs + render";
  const Case cases[] = {
      {[](replay::FrameTimes& f) { f.sent.end_ns -= kOff; }, {stage::kSend, recon}},
      {[](replay::FrameTimes& f) {
         for (const char* node : {"a", "b"}) {
           f.nodes[node].steps[0].end_ns += kOff;
           f.nodes[node].steps[1].start_ns += kOff;
         }
       },
       {recon, stage::kWriteTiles}},
      {[](replay::FrameTimes& f) {
         for (const char* node : {"a", "b"}) f.nodes[node].steps[1].end_ns -= kOff;
       },
       {stage::kWriteTiles, render}},
      {[](replay::FrameTimes& f) { f.nodes["sim"].steps[0].end_ns = f.composited_ns - 6 * ms; },
       {stage::kSimulation, render}},
      {[](replay::FrameTimes& f) { f.nodes["render"].steps[0].end_ns -= kOff; }, {render}}};
  for (const Case& c : cases) {
    auto wrong = right;
    for (replay::FrameTimes& frame : wrong) c.change(frame);
    std::vector<std::string> differ;
    for (const StageAgreement& stage : compared(breakdown_of(wrong, kNodes).by_frame,
                                                outside_stages(messages_of(right), kNodes, 0)))
      if (!stage.agrees() && stage.stage != "all stages") differ.push_back(stage.stage);
    EXPECT_EQ(differ, c.differ);
  }
}

TEST(OutsideTimes, OmitTheFramesWithTheLargestDifferences) {
  StageAgreement stage{"x", std::vector<double>(40, 2.0), std::vector<double>(40, 2.1)};
  std::fill_n(stage.outside_ms.begin(), 10, 4.9);
  EXPECT_TRUE(stage.agrees());
  EXPECT_DOUBLE_EQ(stage.limit_ms(), 0.3);
  EXPECT_NEAR(stage.difference_ms(0.95), 2.9, 1e-12) << "of all frames";
  EXPECT_NEAR(stage.difference_ms(0.05), 0.1, 1e-12);
  std::fill_n(stage.outside_ms.begin(), 13, 4.9);  // more than a quarter
  EXPECT_FALSE(stage.agrees());
  stage = {"x", std::vector<double>(40, 20.0), std::vector<double>(40, 20.9)};
  EXPECT_TRUE(stage.agrees());
  EXPECT_DOUBLE_EQ(stage.limit_ms(), 0.05 * 20.9);
  stage.outside_ms.assign(40, 21.2);
  EXPECT_FALSE(stage.agrees());
  EXPECT_FALSE(StageAgreement{}.agrees()) << "nothing was compared";
}

// The means leave out a quarter at each end, which p5 and p95 see.
TEST(OutsideTimes, DifferIfMoreThanATwentiethOfTheFramesDifferWidely) {
  for (const double off_ms : {-3.1, 3.1}) {
    StageAgreement stage{"x", std::vector<double>(40, 10.0), std::vector<double>(40, 10.0)};
    EXPECT_DOUBLE_EQ(stage.tail_limit_ms(), 3);
    stage.outside_ms[0] += off_ms;
    EXPECT_TRUE(stage.agrees()) << off_ms;
    std::fill_n(stage.outside_ms.begin(), 4, 10 + off_ms);
    EXPECT_FALSE(stage.agrees()) << off_ms;
    stage.own_ms.assign(40, 100.0);
    stage.outside_ms.assign(40, 100.0);
    EXPECT_DOUBLE_EQ(stage.tail_limit_ms(), 5);
    std::fill_n(stage.outside_ms.begin(), 4, 100 + off_ms);
    EXPECT_TRUE(stage.agrees()) << off_ms << ": within 5 %";
  }
}

// capture_node begins a frame after the one before only if a frame was due and enough frames were
// composited.
TEST(OutsideTimes, CaptureIsKnownOnlyIfItWaitedForNothing) {
  auto frames = random_frames(4, 12);
  const auto known = [&](int max_in_flight) {
    std::vector<std::uint64_t> numbers;
    for (const auto& [frame, stages] :
         outside_stages(messages_of(frames), kNodesWithCapture, max_in_flight))
      if (stages.front().first == stage::kCapture) numbers.push_back(frame);
    return numbers;
  };
  EXPECT_EQ(known(0).size(), 11u);  // all but the first
  EXPECT_TRUE(known(1).empty()) << "the frame before is never composited when the next one begins";
  frames[5].frame = frames[4].frame + 1;  // was due just then
  const auto due = known(0);
  EXPECT_EQ(due.size(), 10u);
  EXPECT_EQ(std::count(due.begin(), due.end(), frames[5].frame), 0);
}

TEST(OutsideTimes, CaptureOfFewFramesIsNotCompared) {
  const auto frames = random_frames(5, 30);
  const auto own = breakdown_of(frames, kNodesWithCapture).by_frame;
  auto outside = outside_stages(messages_of(frames), kNodesWithCapture, 0);
  int left = 29;
  for (auto& [frame, stages] : outside)
    if (stages.front().first == stage::kCapture && left > 3) {
      stages.erase(stages.begin());
      --left;
    }
  EXPECT_EQ(compared(own, outside).front().stage, stage::kCapture);
  outside.rbegin()->second.erase(outside.rbegin()->second.begin());
  EXPECT_EQ(compared(own, outside).front().stage, stage::kPublish);
}

}  // namespace
}  // namespace fivepipe::node_bench
