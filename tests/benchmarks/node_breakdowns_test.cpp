// How benchmarks from a recording split a frame's time into stages, and how results are compared.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "benchmarks/nodes/comparison.h"
#include "benchmarks/nodes/node_breakdown.h"
#include "benchmarks/nodes/pipeline_breakdown.h"
#include "common/base/timing.h"

namespace fivepipe::node_bench {
namespace {

constexpr std::int64_t ms = 1'000'000;

std::vector<double> of_step(const std::vector<std::pair<std::string, std::vector<double>>>& steps,
                            const std::string& name) {
  for (const auto& [step, times] : steps)
    if (step == name) return times;
  return {};
}

// Frames of a node every 10 ms: the trigger is sent at 1 ms, read at 2 ms, decoded until 3 ms,
// computed until 7 ms and written until 8 ms.
std::vector<replay::FrameTimes> regular_frames(int count) {
  std::vector<replay::FrameTimes> frames;
  for (int i = 0; i < count; ++i) {
    const std::int64_t t0 = (1000 + 10 * i) * ms;
    replay::FrameTimes frame;
    frame.frame = std::uint64_t(i);
    frame.sent = {t0, t0 + 1 * ms, t0 + 2 * ms};
    frame.nodes["recon"] = {
        t0 + ms,
        t0 + 2 * ms,
        {{"reconstruct", t0 + 3 * ms, t0 + 7 * ms}, {"write_tiles", t0 + 7 * ms, t0 + 8 * ms}}};
    frames.push_back(frame);
  }
  return frames;
}

TEST(NodeBreakdown, AttributesPeriodToItsStages) {
  const NodeBreakdown breakdown = breakdown_of(regular_frames(5), "recon");
  ASSERT_EQ(breakdown.period.size(), 4u);  // the first frame has no period
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_DOUBLE_EQ(breakdown.period[i], 10);
    EXPECT_DOUBLE_EQ(breakdown.own[i], 6);        // 2 to 8 ms: decoding and both steps
    EXPECT_DOUBLE_EQ(breakdown.transport[i], 1);  // 1 to 2 ms; before that no trigger had been sent
    EXPECT_DOUBLE_EQ(breakdown.latency[i], 8);
    EXPECT_DOUBLE_EQ(of_step(breakdown.steps, "decode_inputs")[i], 1);
    EXPECT_DOUBLE_EQ(of_step(breakdown.steps, "reconstruct")[i], 4);
  }
  EXPECT_DOUBLE_EQ(breakdown.own_fraction(), 0.6);
  EXPECT_DOUBLE_EQ(breakdown.explained_fraction(), 0.7);
}

TEST(NodeBreakdown, BusyNodeHasNoTransportTime) {
  std::vector<replay::FrameTimes> frames = regular_frames(3);
  for (std::size_t i = 1; i < 3; ++i) {  // the input arrives before the node is idle at 8 ms
    frames[i].sent.release_ns -= 8 * ms;
    frames[i].nodes["recon"].last_input_ns -= 7 * ms;
  }
  const NodeBreakdown breakdown = breakdown_of(frames, "recon");
  ASSERT_EQ(breakdown.transport.size(), 2u);
  EXPECT_DOUBLE_EQ(breakdown.transport[0], 0);
  EXPECT_DOUBLE_EQ(breakdown.own[0], 10);
  EXPECT_DOUBLE_EQ(breakdown.own_fraction(), 1);
}

TEST(NodeBreakdown, SkipsFramesWithoutOutput) {
  std::vector<replay::FrameTimes> frames = regular_frames(4);
  frames[1].nodes["recon"].steps.clear();
  frames[2].nodes.clear();
  EXPECT_EQ(breakdown_of(frames, "recon").period, std::vector<double>{30});
  EXPECT_TRUE(breakdown_of({}, "recon").period.empty());
  EXPECT_EQ(breakdown_of({}, "recon").own_fraction(), 0);
}

// Frames with random times in a possible order.
std::vector<replay::FrameTimes> random_frames(unsigned seed, int count) {
  std::mt19937 random(seed);
  const auto some = [&] { return std::int64_t(random() % (5 * ms)); };
  std::vector<replay::FrameTimes> frames;
  std::int64_t now = 1000 * ms, rendering_free = 0;
  for (int i = 0; i < count; ++i) {
    replay::FrameTimes frame;
    frame.frame = std::uint64_t(i);
    frame.sent.start_ns = now += some();
    frame.sent.release_ns = now + some();
    frame.sent.end_ns = frame.sent.release_ns + some();
    std::int64_t tiles = 0;
    for (const char* name : {"a", "b"}) {
      const std::int64_t last = frame.sent.end_ns + some() - ms, start = last + some(),
                         written = start + some();
      frame.nodes[name] = {
          last - 1,
          last,
          {{"reconstruct", start, written - 1}, {"write_tiles", written - 1, written}}};
      tiles = std::max(tiles, written);
    }
    const std::int64_t simulated = frame.sent.end_ns + some() + some();
    frame.nodes["sim"] = {
        frame.sent.end_ns, frame.sent.end_ns, {{"simulate", frame.sent.end_ns, simulated}}};
    const std::int64_t taken = std::max(tiles, rendering_free) + some() / 10,
                       start = std::max(taken, simulated), end = start + some();
    frame.nodes["render"] = {taken - 1, taken, {{"render", start, end}}};
    frame.composited_ns = end;
    frame.composite_received_ns = end + ms;
    rendering_free = end;
    frames.push_back(frame);
  }
  return frames;
}

TEST(PipelineBreakdown, StagesSumToMeasuredLatency) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    const PipelineBreakdown breakdown =
        breakdown_of(random_frames(seed, 40), {{"a", "b"}, "sim", "render"});
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
  frames[0].nodes["render"] = {
      slow.steps.back().end_ns,
      slow.steps.back().end_ns,
      {{"render", slow.steps.back().end_ns, slow.steps.back().end_ns + ms}}};
  frames[0].composited_ns = slow.steps.back().end_ns + ms;
  const PipelineBreakdown breakdown = breakdown_of(frames, {{"a", "b"}, "sim", "render"});
  EXPECT_GT(of_step(breakdown.stages, "write_tiles")[0], 99);
  EXPECT_EQ(breakdown.waited_for_state, 0u);
}

TEST(PipelineBreakdown, QueueingAtABusyNodeIsNotBusTime) {
  std::vector<replay::FrameTimes> frames = random_frames(5, 2);
  auto& render = frames[1].nodes["render"];
  const std::int64_t busy_until = frames[0].nodes["render"].steps.back().end_ns =
      render.last_input_ns - ms / 4;
  frames[1].nodes["a"].steps.back().end_ns = frames[1].nodes["b"].steps.back().end_ns =
      busy_until - 2 * ms;
  const PipelineBreakdown breakdown = breakdown_of(frames, {{"a", "b"}, "sim", "render"});
  EXPECT_NEAR(of_step(breakdown.stages, "rendering busy with frames before")[1], 2, 1e-9);
  EXPECT_NEAR(of_step(breakdown.stages, "bus to rendering")[1], 0.25, 1e-9);
}

nlohmann::json suite(std::initializer_list<std::pair<const char*, double>> medians) {
  nlohmann::json results = nlohmann::json::array();
  for (const auto& [name, median] : medians)
    results.push_back({{"name", name},
                       {"time_ms", {{"median", median}}},
                       {"error", {{"max_mm", 0.5}}},
                       {"checksum", "12"}});
  return {{"suite", "s"}, {"machine", {{"cpu", "x"}}}, {"results", results}};
}

TEST(Comparison, MatchesByNameAndComputesRatio) {
  const Comparison comparison =
      compared(suite({{"a", 2}, {"b", 4}, {"gone", 1}}), suite({{"b", 3}, {"a", 2.5}, {"new", 1}}));
  ASSERT_EQ(comparison.results.size(), 2u);
  EXPECT_EQ(comparison.results[0].name, "a");
  EXPECT_DOUBLE_EQ(comparison.results[0].ratio(), 1.25);
  EXPECT_DOUBLE_EQ(comparison.results[1].ratio(), 0.75);
  EXPECT_EQ(comparison.only_before, std::vector<std::string>{"gone"});
  EXPECT_EQ(comparison.only_after, std::vector<std::string>{"new"});
  EXPECT_TRUE(comparison.machines.empty());
  EXPECT_FALSE(comparison.results[0].output_differs);
}

TEST(Comparison, ReportsChangedOutputLargerErrorsAndOtherMachines) {
  nlohmann::json after = suite({{"a", 1}});
  after["results"][0]["checksum"] = "13";
  after["results"][0]["error"]["max_mm"] = 0.75;
  after["machine"]["cpu"] = "y";
  const Comparison comparison = compared(suite({{"a", 2}}), after);
  EXPECT_TRUE(comparison.results[0].output_differs);
  EXPECT_EQ(comparison.results[0].worse_errors,
            std::vector<std::string>{"max_mm: 0.75 instead of 0.5"});
  EXPECT_NE(comparison.machines.find("\"y\""), std::string::npos);
}

TEST(Comparison, SlowerMeansAboveTheRatioOrNotMeasured) {
  const auto slower = [](double before_ms, double after_ms) {
    return ComparedResult{
        .name = "", .before_ms = before_ms, .after_ms = after_ms, .worse_errors = {}}
        .is_slower_than(1.05);
  };
  EXPECT_FALSE(slower(1, 1.04));
  EXPECT_TRUE(slower(1, 1.06));
  EXPECT_FALSE(slower(0, 0));  // a stage that takes no time
  EXPECT_TRUE(slower(0, 0.1));
  EXPECT_TRUE(slower(1, 0));
  EXPECT_TRUE(slower(1, std::nan("")));
}

TEST(Comparison, RejectsInvalidResult) {
  const nlohmann::json good = suite({{"a", 1}});
  for (const nlohmann::json& bad :
       {nlohmann::json(3), nlohmann::json::object(), nlohmann::json{{"results", 5}},
        nlohmann::json{{"results", {5}}}, nlohmann::json{{"results", {{{"name", 7}}}}},
        nlohmann::json{{"results", {{{"name", "a"}}}}},
        nlohmann::json{{"results", {{{"name", "a"}, {"time_ms", {{"median", "fast"}}}}}}}}) {
    EXPECT_THROW(compared(bad, good), std::runtime_error) << bad;
    EXPECT_THROW(compared(good, bad), std::runtime_error) << bad;
  }
}

}  // namespace
}  // namespace fivepipe::node_bench
