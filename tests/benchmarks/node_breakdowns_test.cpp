// How the benchmark of a node splits the time of a frame, and how results are compared.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "benchmarks/nodes/comparison.h"
#include "benchmarks/nodes/node_breakdown.h"
#include "tests/support/time_units.h"

namespace fivepipe::node_bench {
namespace {

using test::ms;

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
