#include "launch/supervise/work_per_set.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "launch/supervise/report.h"
#include "tests/launch/supervise/statuses.h"
#include "tests/support/time_units.h"

using namespace fivepipe;
using namespace fivepipe::test;

namespace {

// 101 composited sets on two cores: per set 12 ms decoding, 3 segmentation, 1 publishing, 6 + 2
// hull, 0.5 simulation, 4 drawing. recon_b was restarted.
launch::ReportInput two_cores(double rate_hz) {
  launch::ReportInput input;
  input.cores = 2;
  input.start_stamp_ns = 100 * s;
  input.first_composited_stamp_ns = 100 * s;
  input.stop_stamp_ns = 100 * s + std::int64_t(100 * 1e9 / rate_hz);
  const auto add = [&](const char* node, std::uint32_t pid, std::uint64_t cpu_us,
                       std::map<std::string, std::uint64_t> counts = {}) {
    auto of_process = status(node, pid, pid * s);
    of_process.counts = std::move(counts);
    of_process.counts["cpu_us_frames"] = cpu_us;
    input.statuses.add(of_process, 110 * s);
  };
  input.programs = {{"capture", "capture_node", {{1, 0, ""}}},
                    {"recon_a", "recon_node", {{2, 0, ""}}},
                    {"recon_b", "recon_node", {{3, 0, ""}, {4, 0, ""}}},
                    {"sim", "sim_node", {{5, 0, ""}}},
                    {"render", "render_node", {{6, 0, ""}}}};
  add("capture", 1, 1'600'000, {{"cpu_us_segmentation", 300'000}, {"cpu_us_publishing", 100'000}});
  add("recon_a", 2, 600'000);
  add("recon_b", 3, 50'000);
  add("recon_b", 4, 150'000);
  add("sim", 5, 50'000);
  add("render", 6, 400'000, {{"frames_composited", 101}});
  return input;
}

}  // namespace

TEST(WorkPerSet, DividesTheTimeOfEachPartByTheSetsAfterTheFirst) {
  const auto work = launch::report_from(two_cores(50))["core_ms_per_set"];
  const std::map<std::string, double> expected{
      {"decoding", 12},    {"segmentation", 3}, {"publishing", 1}, {"hull", 8},
      {"simulation", 0.5}, {"drawing", 4},      {"sum", 28.5}};
  ASSERT_EQ(work.size(), expected.size());
  for (const auto& [part, expected_ms] : expected)
    EXPECT_NEAR(work[part].get<double>(), expected_ms, 1e-9) << part;
}

TEST(WorkPerSet, NamesWhatBoundsTheRate) {
  const auto bound = [](const launch::ReportInput& input) {
    return launch::report_from(input)["rate_bound"].get<std::string>();
  };
  // 28.5 core-ms at 60 Hz are 1.71 of 2 cores.
  EXPECT_EQ(bound(two_cores(60)), "the processor: decoding takes 12.0 of 28.5 core-ms per set");
  EXPECT_EQ(bound(two_cores(20)),
            "waiting: the nodes use 29 % of the 2 cores, capture most with 0.32 cores; decoding "
            "takes 12.0 of 28.5 core-ms per set");
  auto clocked = two_cores(20);
  clocked.requested_rate_hz = 20.5;
  EXPECT_EQ(bound(clocked), "the requested rate of 20.5 Hz");
  clocked.requested_rate_hz = 25;
  EXPECT_TRUE(bound(clocked).starts_with("waiting: ")) << bound(clocked);
  // The work of another host's cores is unknown here.
  auto two_hosts = two_cores(60);
  two_hosts.programs[1].processes.clear();
  EXPECT_EQ(bound(two_hosts), "");
}

TEST(WorkPerSet, IsUnknownAfterAFewSets) {
  auto input = two_cores(50);
  auto render = *input.statuses.newest("render");
  render.counts["frames_composited"] = launch::kMinSets - 1;
  input.statuses.add(render, 111 * s);
  const auto report = launch::report_from(input);
  EXPECT_TRUE(report["core_ms_per_set"].is_null());
  EXPECT_EQ(report["rate_bound"], "");
  EXPECT_EQ(launch::table_of(report).find("core-ms"), std::string::npos);
}

TEST(WorkPerSet, IsInTheTable) {
  const std::string table = launch::table_of(launch::report_from(two_cores(60)));
  EXPECT_NE(
      table.find("processor time per set: 28.5 core-ms (decoding 12.0, drawing 4.0, hull 8.0, "
                 "publishing 1.0, segmentation 3.0, simulation 0.5)\n"),
      std::string::npos)
      << table;
  EXPECT_NE(table.find("the rate is bound by the processor: decoding"), std::string::npos) << table;
}
