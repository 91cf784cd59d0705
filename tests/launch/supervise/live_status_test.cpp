// The texts of `fivepipe up` and `fivepipe top` about running nodes, word for word and at their
// limits, and the tables of counts that they shorten.
#include "launch/supervise/status/live_status.h"

#include <gtest/gtest.h>

#include "launch/supervise/status/largest_counts.h"
#include "tests/launch/supervise/statuses.h"
#include "tests/support/text.h"
#include "tests/support/time_units.h"

using namespace fivepipe;
using namespace fivepipe::test;

namespace {

// "a00", "a01", ..
std::string numbered(const std::string& prefix, int number) {
  return prefix + (number < 10 ? "0" : "") + std::to_string(number);
}

}  // namespace

TEST(NodesTable, ShowsANodePerLineInColumns) {
  launch::StatusRegistry registry;
  auto render = status("render", 1);
  render.cpu_s = 10;
  registry.add(render, 10 * s);
  render.cpu_s = 10.255;
  render.frame = 240;
  render.frame_rate_hz = 19.96;
  render.memory_mb = 123.6;
  render.drops = {{"late_map", 3}, {"late_state", 40}};
  render.latencies["capture_to_composite"] = {12.34, 20, 31.06, 50, 240};
  render.latencies["draw"] = {1, 2, 3, 4, 240};
  registry.add(render, 10 * s + s / 2);
  auto sim = status("sim", 2);
  sim.frame = 7;
  sim.frame_rate_hz = 30;
  sim.final_report = true;
  registry.add(sim, 10 * s + s / 2);
  auto recon = status("recon", 3);
  recon.frame_rate_hz = 30;
  registry.add(recon, 10 * s + s / 2 - 400 * ms);
  // The status of render is 2 s old, as old as that of an active node may be.
  EXPECT_EQ(
      launch::nodes_table(registry, 12 * s + s / 2),
      "node            host      state            frame      Hz   CPU %  memory MB    drops  "
      "latencies p50/p99 ms\n"
      "recon           alpha     silent 2 s           0       -       -          0        0\n"
      "render          alpha     running            240    20.0      51        124       43  "
      "capture_to_composite 12.3/31.1, draw 1.0/3.0\n"
      "sim             alpha     ended                7       -       -          0        0\n");
}

TEST(NodesTable, ShowsTheHostsOfTheDeploymentAndItsNodesWithoutStatus) {
  launch::StatusRegistry registry;
  registry.add(status("render", 1), 10 * s);
  registry.add(status("sim", std::nullopt, s), 10 * s);
  registry.add(status("stranger", 3), 10 * s);
  EXPECT_EQ(
      launch::nodes_table(registry, 10 * s,
                          {{"render", "lab1"}, {"recon", "lab2"}, {"sim", ""}, {"x", ""}}),
      "node            host      state            frame      Hz   CPU %  memory MB    drops  "
      "latencies p50/p99 ms\n"
      "recon           lab2      no status            -       -       -          -        -\n"
      "x               -         no status            -       -       -          -        -\n"
      "render          lab1      running              0     0.0       0          0        0\n"
      "sim             -         running              0     0.0       0          0        0\n"
      "stranger        alpha     running              0     0.0       0          0        0\n");
}

TEST(NodesTable, ShowsFiftyNodesAndTwentyLatencies) {
  launch::StatusRegistry registry;
  for (int i = 0; i < 50; ++i) {
    auto node = status(numbered("node", i), std::uint32_t(i));
    for (int k = 0; k < (i == 0 ? 20 : i == 1 ? 21 : 0); ++k)
      node.latencies[numbered("latency", k)] = {};
    registry.add(node, 10 * s);
  }
  const std::string fifty = launch::nodes_table(registry, 10 * s);
  EXPECT_EQ(test::line_count(fifty), 1 + 50);
  std::size_t at = 0;
  for (int shown = 0; shown < 2 * 20; ++shown) {
    at = fifty.find("latency", at + 1);
    ASSERT_NE(at, std::string::npos) << shown;
  }
  EXPECT_EQ(fifty.find("latency", at + 1), std::string::npos) << "of the second node's 21";
  registry.add(status("node50", 50), 10 * s);
  const std::string more = launch::nodes_table(registry, 10 * s);
  EXPECT_EQ(test::line_count(more), 1 + 50 + 1);
  EXPECT_TRUE(more.ends_with("and 1 more node\n")) << more;
  EXPECT_FALSE(contains(more, "node50"));
}

TEST(NodesTable, NodesOfAProcessWithManyNodesComeLast) {
  launch::StatusRegistry registry;
  for (const auto& [node, pid] : {std::pair{"a", 1}, {"b", 2}, {"c", 1}, {"d", 3}})
    registry.add(status(node, std::uint32_t(pid)), 10 * s);
  const std::string table = launch::nodes_table(registry, 10 * s);
  std::string order;
  for (std::size_t at = table.find('\n'); at + 1 < table.size(); at = table.find('\n', at + 1))
    order += table[at + 1];
  EXPECT_EQ(order, "bdac");
}

TEST(NodeMessages, AreListedByNode) {
  launch::StatusRegistry registry;
  auto render = status("render", 1);
  render.counts = {{"refused from process 9 on host beta", 5}, {"frames_composited", 100}};
  render.drops = {{"late_map: wall1", 3}, {"late_state", 40}};
  render.diagnostics = {"hull: empty", "camera left: dark"};
  registry.add(render, 10 * s);
  EXPECT_EQ(launch::node_messages(registry),
            "render: refused 5 messages from process 9 on host beta\n"
            "render: dropped 3: late_map: wall1\n"
            "render: dropped 40: late_state\n"
            "render: hull: empty\n"
            "render: camera left: dark\n");
  registry.ignore();
  registry.ignore();
  EXPECT_TRUE(launch::node_messages(registry).ends_with(
      "camera left: dark\n"
      "ignored 2 status messages: too many nodes, or an impossible start of the process\n"));
}

TEST(NodeMessages, AreAtMostTwentyOfAKindAndTwoHundredInAll) {
  const auto shown_of = [](std::size_t diagnostics) {
    launch::StatusRegistry registry;
    auto node = status("sim", 1);
    node.diagnostics.assign(diagnostics, "table: low");
    registry.add(node, 10 * s);
    return launch::node_messages(registry);
  };
  EXPECT_EQ(test::line_count(shown_of(19)), 19);
  EXPECT_EQ(test::line_count(shown_of(20)), 20);
  EXPECT_EQ(test::line_count(shown_of(21)), 20);

  launch::StatusRegistry registry;
  for (std::uint32_t i = 0; i < 10; ++i) {
    auto node = status(numbered("node", int(i)), i);
    node.diagnostics.assign(20, "table: low");
    registry.add(node, 10 * s);
  }
  const std::string all = launch::node_messages(registry);
  EXPECT_EQ(test::line_count(all), 200);
  EXPECT_FALSE(contains(all, "more lines"));
  auto one_more = status("z", 10);
  one_more.diagnostics = {"table: high", "table: low"};
  registry.add(one_more, 10 * s);
  EXPECT_EQ(launch::node_messages(registry), all + "and 2 more lines\n");
}

TEST(NodeMessages, NameTwentyDuplicateNodes) {
  launch::StatusRegistry registry;
  const auto add_duplicate = [&](int i) {
    const std::string node = numbered("node", i);
    registry.add(status(node, 1, 1 * s), 10 * s);
    registry.add(status(node, 2, 2 * s), 10 * s);
    registry.add(status(node, 1, 1 * s), 13 * s);
  };
  for (int i = 0; i < 20; ++i) add_duplicate(i);
  const std::string all = launch::node_messages(registry);
  EXPECT_EQ(test::line_count(all), 20);
  EXPECT_TRUE(
      all.starts_with("2 processes publish as node 'node00': process 1 on host alpha, "
                      "process 2 on host alpha\n"))
      << all;
  add_duplicate(20);
  EXPECT_EQ(launch::node_messages(registry), all);
}

TEST(ProgressLine, ANodeIsSilentAndRenderingHasStoppedOnlyAfterTheLimit) {
  launch::StatusRegistry registry;
  auto render = status("render", 1);
  render.frame_rate_hz = 20;
  registry.add(render, 10 * s);
  launch::Progress progress{.elapsed_s = 12.6,
                            .frame_rate_hz = 0.5,
                            .render_nodes = {"render"},
                            .composited = 1,
                            .newest_frame_age_s = 6,
                            .expected = {"render"}};
  EXPECT_EQ(launch::progress_line(progress, registry, 12 * s),
            "13 s: 1 frame composited, now 20.0 frames/s");
  EXPECT_EQ(launch::progress_line(progress, registry, 12 * s + 400 * ms),
            "13 s: 1 frame composited, now 0.0 frames/s; render: no status for 2 s");
  progress.newest_frame_age_s = 6.001;
  EXPECT_EQ(launch::progress_line(progress, registry, 12 * s),
            "13 s: 1 frame composited, no frame for 6 s");
}

// Only its own host can know whether it hangs.
TEST(ProgressLine, ASilentNodeOfAnotherHostIsOutOfReach) {
  launch::StatusRegistry registry;
  for (const char* node : {"capture", "recon", "render"}) registry.add(status(node, 1), 10 * s);
  const launch::Progress progress{
      .elapsed_s = 14,
      .render_nodes = {"render"},
      .composited = 240,
      .newest_frame_age_s = 4,
      .expected = {"capture", "recon", "render", "sim"},
      .other_hosts = {{"capture", "lab2"}, {"recon", ""}, {"sim", "b"}}};
  EXPECT_EQ(launch::progress_line(progress, registry, 14 * s),
            "14 s: 240 frames composited, no frame for 4 s; capture: out of reach, no status from "
            "host lab2 for 4 s; recon: out of reach, no status from another host for 4 s; render: "
            "no status for 4 s; sim: no status yet");
}

TEST(ProgressLine, NamesMissingHostsBeforeNodes) {
  launch::Progress progress{.elapsed_s = 5,
                            .render_nodes = {"render"},
                            .newest_frame_age_s = {},
                            .missing_hosts = {"waiting for host a (10.0.0.1): no answer"},
                            .expected = {"render"}};
  EXPECT_EQ(launch::progress_line(progress, {}, 0),
            "5 s: no frame composited yet; waiting for host a (10.0.0.1): no answer; render: no "
            "status yet");
}

TEST(ProgressLine, StartsWithoutTimeAndFrames) {
  launch::Progress progress;
  EXPECT_EQ(launch::progress_line(progress, {}, 0), "0 s: no render_node");
  progress.render_nodes = {"render"};
  EXPECT_EQ(launch::progress_line(progress, {}, 0), "0 s: no frame composited yet");
  progress.newest_frame_age_s = 2;
  EXPECT_EQ(launch::progress_line(progress, {}, 0), "0 s: 0 frames composited, now 0.0 frames/s");
}

TEST(LargestCounts, SumsTheSmallestOnesAsOther) {
  const launch::Counts counts = {{"a", 1}, {"b", 5}, {"c", 1}, {"d", 3}};
  EXPECT_EQ(launch::largest(counts, 4), counts);
  EXPECT_EQ(launch::largest(counts, 3),
            (launch::Counts{{"b", 5}, {"d", 3}, {"a", 1}, {"other", 1}}));
  EXPECT_EQ(launch::largest(counts, 1), (launch::Counts{{"b", 5}, {"other", 5}}));
}

TEST(LargestCounts, AreSixtyFourTheFirstByNameAmongEquals) {
  launch::Counts counts;
  for (int i = 0; i < 64; ++i) counts[numbered("n", i)] = 2;
  EXPECT_EQ(launch::largest(counts), counts);
  launch::Counts expected = counts;
  counts["n64"] = counts["n65"] = 2;
  expected["other"] = 4;
  EXPECT_EQ(launch::largest(counts), expected);
}

TEST(LargestCounts, SumTheSmallestDropsByReason) {
  launch::Counts drops, expected;
  for (int i = 0; i < 63; ++i) drops[numbered("bad_map: ", i)] = 10;
  expected = drops;
  drops["bad_map: 90"] = expected["bad_map: 90"] = 9;
  EXPECT_EQ(launch::largest_drops(drops), expected);
  drops["bad_map: 91"] = 8;
  drops["bad_map: 92: detail"] = 7;
  drops["late_map"] = 1;
  expected["bad_map: other"] = 15;
  expected["late_map"] = 1;
  EXPECT_EQ(launch::largest_drops(drops), expected);
}

TEST(LargestCounts, DropsOfMoreThanThirtyTwoFurtherReasonsCountTogether) {
  launch::Counts drops, expected;
  for (int i = 0; i < 64; ++i) drops[numbered("bad_map: ", i)] = 10;
  expected = drops;
  for (int i = 0; i < 35; ++i) drops[numbered("invented_", i) + ": x"] = 1;
  for (int i = 0; i < 32; ++i) expected[numbered("invented_", i) + ": other"] = 1;
  expected["other"] = 3;
  EXPECT_EQ(launch::largest_drops(drops), expected);
}

TEST(LargestCounts, RefusedMessagesAreNamedByTheirSender) {
  EXPECT_EQ(launch::refused_from({{"frames", 3},
                                  {"refused from process 1 on host a", 4},
                                  {"refused from process 2 on host b", 5}}),
            (launch::Counts{{"process 1 on host a", 4}, {"process 2 on host b", 5}}));
}
