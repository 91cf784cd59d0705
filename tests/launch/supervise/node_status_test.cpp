// The newest statuses of processes, and the texts about running nodes.
#include <gtest/gtest.h>

#include "launch/supervise/status/live_status.h"
#include "tests/launch/supervise/statuses.h"
#include "tests/support/text.h"
#include "tests/support/time_units.h"

using namespace fivepipe;
using namespace fivepipe::test;

TEST(StatusRegistry, DetectsDuplicateNodes) {
  launch::StatusRegistry registry;
  registry.add(status("sim", kFirst, 1 * s), 10 * s);
  registry.add(status("sim", kSecond, 9 * s), 11 * s);
  EXPECT_TRUE(registry.duplicates().empty()) << "the first process may have died";
  registry.add(status("sim", kFirst, 1 * s), 13 * s);
  ASSERT_EQ(registry.duplicates().size(), 1u);
  EXPECT_EQ(launch::text_of(registry.duplicates()[0]),
            "2 processes publish as node 'sim': process 12 on host alpha, process 34 on host "
            "alpha");
  registry.add(status("sim", bus::ProcessId{"beta", 12, 1}, 8 * s), 14 * s);
  for (const bus::ProcessId& process : {kFirst, kSecond})
    registry.add(status("sim", process, (process == kFirst ? 1 : 9) * s), 16 * s);
  EXPECT_TRUE(contains(launch::text_of(registry.duplicates().at(0)), "3 processes publish as"));
}

TEST(StatusRegistry, RestartIsNotADuplicate) {
  launch::StatusRegistry registry;
  registry.add(status("sim", kFirst, 1 * s), 10 * s);
  registry.add(status("sim", kSecond, 9 * s), 11 * s);
  // Arrives after the death of its process.
  registry.add(status("sim", kFirst, 1 * s), 11 * s + s / 2);
  for (int i = 12; i < 60; ++i) registry.add(status("sim", kSecond, 9 * s), i * s);
  EXPECT_TRUE(registry.duplicates().empty());
  EXPECT_EQ(registry.processes().at("sim").size(), 2u);
}

TEST(StatusRegistry, TwoHostsWithEqualPidsAndStartsAreTwoProcesses) {
  launch::StatusRegistry registry;
  registry.add(status("sim", bus::ProcessId{"alpha", 12, 1}, 1 * s), 10 * s);
  registry.add(status("sim", bus::ProcessId{"beta", 12, 1}, 1 * s), 10 * s);
  EXPECT_EQ(registry.processes().at("sim").size(), 2u);
}

TEST(StatusRegistry, AProcessIsOneAfterAnySilence) {
  launch::StatusRegistry registry;
  registry.add(status("sim", kFirst, 1 * s), 10 * s);
  registry.add(status("sim", kFirst, 1 * s), 1000 * s);
  registry.add(status("sim", kFirst, 1 * s), 1002 * s);
  EXPECT_EQ(registry.processes().at("sim").size(), 1u);
  EXPECT_TRUE(registry.duplicates().empty());
}

TEST(StatusRegistry, StatusesWithoutIdentityAreDistinguishedByTheirStart) {
  launch::StatusRegistry registry;
  registry.add(status("sim", std::nullopt, 1 * s), 10 * s);
  registry.add(status("sim", std::nullopt, 1 * s), 20 * s);
  EXPECT_EQ(registry.processes().at("sim").size(), 1u);
  registry.add(status("sim", std::nullopt, 2 * s), 20 * s);
  EXPECT_EQ(registry.processes().at("sim").size(), 2u);
  // The identity arrives after the first statuses, and is not forgotten.
  registry.add(status("sim", kFirst, 1 * s), 21 * s);
  for (const int start : {1, 2}) registry.add(status("sim", std::nullopt, start * s), 22 * s);
  ASSERT_EQ(registry.processes().at("sim").size(), 2u);
  EXPECT_EQ(registry.processes().at("sim")[0].process, kFirst);
  EXPECT_EQ(registry.processes().at("sim")[1].process, std::nullopt);
}

TEST(StatusRegistry, BoundsNodesAndKeepsTheTotalsOfManyProcesses) {
  launch::StatusRegistry registry;
  const int processes = 3 * int(launch::StatusRegistry::kMaxProcesses);
  for (int i = 1; i <= processes; ++i) {
    auto one = status("sim", bus::ProcessId{"alpha", std::uint32_t(i), 1}, i * s);
    one.counts["frames"] = 10;
    one.drops["late_map"] = 1;
    one.topics["topic"].sent = 2;
    one.collisions["ball"].frames = 3;
    registry.add(one, (100 + i) * s);
  }
  const auto kept = registry.processes().at("sim");
  EXPECT_EQ(kept.size(), launch::StatusRegistry::kMaxProcesses);
  std::uint64_t frames = 0, drops = 0, sent = 0, collided = 0;
  for (const auto& process : kept) {
    frames += process.counts.at("frames");
    drops += process.drops.at("late_map");
    sent += process.topics.at("topic").sent;
    collided += process.collisions.at("ball").frames;
  }
  EXPECT_EQ(frames, 10u * processes);
  EXPECT_EQ(drops, 1u * processes);
  EXPECT_EQ(sent, 2u * processes);
  EXPECT_EQ(collided, 3u * processes);
  registry.add(status("sim", bus::ProcessId{"alpha", std::uint32_t(processes), 1}, processes * s),
               200 * s);
  for (std::size_t i = 0; i < 2 * launch::StatusRegistry::kMaxNodes; ++i)
    registry.add(
        status("invented" + std::to_string(i), bus::ProcessId{"alpha", std::uint32_t(i), 1}, s),
        200 * s);
  EXPECT_EQ(registry.processes().size(), launch::StatusRegistry::kMaxNodes);
  EXPECT_TRUE(registry.newest("sim"));
}

TEST(StatusRegistry, TheTotalsOfProcessesWithInventedNamesAreBounded) {
  launch::StatusRegistry registry;
  constexpr int kProcesses = 200, kNames = 200;
  for (int process = 0; process < kProcesses; ++process) {
    auto one = status("sim", kFirst, process);
    for (int i = 0; i < kNames; ++i) {
      const std::string name = std::to_string(process) + "_" + std::to_string(i);
      one.counts[name] = one.drops[name] = one.empty_cameras[name] = 1;
      one.topics[name].sent = one.collisions[name].frames = one.latencies[name].count = 1;
    }
    registry.add(one, process);
  }
  std::uint64_t counted = 0;
  const auto processes = registry.processes();
  for (const auto& process : processes.at("sim")) {
    EXPECT_LE(process.counts.size(), launch::kMaxStatusEntries + 1);
    EXPECT_LE(process.drops.size(), launch::kMaxStatusEntries + 1);
    EXPECT_LE(process.empty_cameras.size(), launch::kMaxStatusEntries + 1);
    EXPECT_LE(process.topics.size(), launch::kMaxStatusEntries + 1);
    EXPECT_LE(process.collisions.size(), launch::kMaxStatusEntries + 1);
    EXPECT_LE(process.latencies.size(), launch::kMaxStatusEntries + 1);
    for (const auto& [name, count] : process.counts) counted += count;
  }
  EXPECT_EQ(counted, std::uint64_t(kProcesses * kNames));
}

TEST(StatusRegistry, EndedAndSilentNodesLeaveSpaceForOthers) {
  constexpr int kMax = int(launch::StatusRegistry::kMaxNodes);
  for (const bool ended : {false, true}) {
    launch::StatusRegistry registry;
    for (int i = 0; i < kMax; ++i) {
      auto one =
          status("node_" + std::to_string(i), bus::ProcessId{"alpha", std::uint32_t(i), 1}, s);
      one.final_report = ended;
      registry.add(one, 10 * s + i);
    }
    registry.add(status("early", kSecond, s), 11 * s);
    EXPECT_EQ(registry.newest("early") != nullptr, ended) << "all nodes are active";
    EXPECT_EQ(registry.ignored(), ended ? 0u : 1u);
    registry.add(status("sim", kSecond, s), 13 * s);
    EXPECT_TRUE(registry.newest("sim"));
    EXPECT_FALSE(registry.newest("node_0")) << "has the oldest status";
    EXPECT_TRUE(registry.newest("node_" + std::to_string(kMax - 1)));
    EXPECT_EQ(registry.processes().size(), launch::StatusRegistry::kMaxNodes);
  }
}

TEST(StatusRegistry, InventedNodesOfOneProcessLeaveSpaceForThoseOfOthers) {
  launch::StatusRegistry registry;
  for (std::size_t i = 0; i < 2 * launch::StatusRegistry::kMaxNodes; ++i)
    registry.add(status("invented" + std::to_string(i), kFirst, s), 1 * s);
  EXPECT_EQ(registry.processes().size(), launch::StatusRegistry::kMaxNodesOfProcess);
  registry.add(status("sim", kSecond, s), 2 * s);
  EXPECT_TRUE(registry.newest("sim"));
}

TEST(StatusRegistry, CpuPercentIsBetweenTheTwoNewestStatuses) {
  launch::StatusRegistry registry;
  auto one = status("sim", kFirst, 0);
  one.cpu_s = 100;
  registry.add(one, 10 * s);
  EXPECT_EQ(registry.cpu_percent("sim"), 0);
  one.cpu_s = 100.5;
  registry.add(one, 11 * s);
  EXPECT_DOUBLE_EQ(registry.cpu_percent("sim"), 50);
}

namespace {

// render composites 20 frames/s, sim publishes too; both statuses arrived at 10 s.
struct Running {
  launch::StatusRegistry registry;
  launch::Progress progress{.elapsed_s = 12,
                            .render_nodes = {"render"},
                            .composited = 240,
                            .newest_frame_age_s = 0.05,
                            .expected = {"render", "sim"}};
  Running() {
    auto render = status("render", kFirst, s), sim = status("sim", kSecond, s);
    render.frame_rate_hz = sim.frame_rate_hz = 20;
    render.frame = sim.frame = 240;
    registry.add(render, 10 * s);
    registry.add(sim, 10 * s);
  }
};

}  // namespace

TEST(ProgressLine, StatesFramesAndTheirRate) {
  const Running running;
  EXPECT_EQ(launch::progress_line(running.progress, running.registry, 10 * s + s / 2),
            "12 s: 240 frames composited, now 20.0 frames/s");
}

TEST(ProgressLine, StatesTheRateOfTheSlowestRenderNode) {
  Running running;
  auto slow = status("slow", kSecond, s);
  slow.frame_rate_hz = 7;
  running.registry.add(slow, 10 * s);
  running.progress.render_nodes = {"render", "slow"};
  EXPECT_EQ(launch::progress_line(running.progress, running.registry, 10 * s + s / 2),
            "12 s: 240 frames composited, now 7.0 frames/s");
}

TEST(ProgressLine, RepeatsNoRateOnceRenderingHasStopped) {
  Running running;
  running.progress.newest_frame_age_s = 4.2;
  EXPECT_EQ(launch::progress_line(running.progress, running.registry, 10 * s + s / 2),
            "12 s: 240 frames composited, no frame for 4 s");
  running.progress.newest_frame_age_s.reset();
  EXPECT_EQ(launch::progress_line(running.progress, running.registry, 10 * s + s / 2),
            "12 s: no frame composited yet");
}

TEST(ProgressLine, ASlowDeploymentIsNotStalledBetweenItsFrames) {
  Running running;
  running.progress.frame_rate_hz = 0.1;
  running.progress.newest_frame_age_s = 10;
  EXPECT_TRUE(contains(launch::progress_line(running.progress, running.registry, 10 * s), "now "));
  running.progress.newest_frame_age_s = 31;
  EXPECT_TRUE(contains(launch::progress_line(running.progress, running.registry, 10 * s),
                       "no frame for 31 s"));
  EXPECT_DOUBLE_EQ(launch::max_frame_gap_s(1000), 2);
}

TEST(ProgressLine, AnEndedNodeIsNotSilent) {
  Running running;
  auto sim = status("sim", kSecond, s), render = status("render", kFirst, s);
  sim.final_report = true;
  running.registry.add(sim, 11 * s);
  running.registry.add(render, 20 * s);
  EXPECT_EQ(launch::progress_line(running.progress, running.registry, 20 * s),
            "12 s: 240 frames composited, now 0.0 frames/s");
}

TEST(ProgressLine, NamesNodesWithoutRecentStatus) {
  Running running;
  running.progress.expected.push_back("recon_a");
  running.registry.add(status("sim", kSecond, s), 14 * s);
  EXPECT_EQ(launch::progress_line(running.progress, running.registry, 14 * s + s / 2),
            "12 s: 240 frames composited, now 0.0 frames/s; render: no status for 4 s; recon_a: no "
            "status yet");
}

TEST(ProgressLine, ADeploymentMayHaveNoRenderNode) {
  launch::Progress progress;
  progress.elapsed_s = 5;
  EXPECT_EQ(launch::progress_line(progress, {}, 0), "5 s: no render_node");
}

TEST(NodesTable, ASilentNodeHasNoRates) {
  const Running running;
  const std::string active = launch::nodes_table(running.registry, 10 * s);
  EXPECT_TRUE(contains(active, " 20.0 ") && contains(active, "running")) << active;
  const std::string table = launch::nodes_table(running.registry, 14 * s);
  EXPECT_TRUE(contains(table, "silent 4 s")) << table;
  EXPECT_FALSE(contains(table, "20.0")) << table;
}

TEST(NodesTable, DistinguishesAnEndedNodeFromASilentOne) {
  Running running;
  auto sim = status("sim", kSecond, s);
  sim.final_report = true;
  running.registry.add(sim, 11 * s);
  const std::string table = launch::nodes_table(running.registry, 11 * s);
  EXPECT_TRUE(contains(table, "ended")) << table;
  EXPECT_FALSE(contains(table, "silent")) << table;
}

TEST(NodesTable, APeersTextCannotControlTheTerminal) {
  Running running;
  auto hostile = status("\x1b[2J", kFirst, s);
  hostile.drops["\x1b]0;title"] = 1;
  hostile.diagnostics = {"subject: \r\n"};
  hostile.latencies["\x1b["] = {};
  running.registry.add(hostile, 10 * s);
  for (const std::string& text :
       {launch::nodes_table(running.registry, 10 * s), launch::node_messages(running.registry)})
    for (const char c : text) EXPECT_TRUE(c >= ' ' || c == '\n') << text;
}

TEST(NodeMessages, StateHowManyStatusesAreIgnored) {
  Running running;
  EXPECT_FALSE(contains(launch::node_messages(running.registry), "ignored"));
  running.registry.ignore();
  EXPECT_TRUE(contains(launch::node_messages(running.registry), "ignored 1 status message:"));
}

// `fivepipe top` prints this each second.
TEST(LiveStatus, IsBoundedForInventedNodesAndDropsAndShowsRealNodesFirst) {
  launch::StatusRegistry registry;
  for (std::uint32_t node = 0; node < 250; ++node) {
    const bus::ProcessId peer{"alpha", 1000 + node / 60, 1};  // publishes many nodes
    auto invented = status("invented_" + std::to_string(node), peer, 1 * s);
    for (int i = 0; i < 60; ++i) {
      const std::string name = "invented_" + std::to_string(i);
      invented.drops[name] = 1;
      invented.counts["refused from " + name] = 1;
      invented.latencies[name] = {};
      invented.diagnostics.push_back(name);
    }
    registry.add(invented, 1 * s);
    // Makes it two processes of one node.
    invented.process->start_id = 2;
    invented.start_stamp_ns = 2 * s;
    registry.add(invented, 2 * s);
    invented.process->start_id = 1;
    invented.start_stamp_ns = 1 * s;
    registry.add(invented, 5 * s);
  }
  auto sim = status("sim", kFirst, 1 * s);
  sim.counts["refused from process 1000 on host alpha"] = 7;
  registry.add(sim, 5 * s);
  const std::string table = launch::nodes_table(registry, 6 * s),
                    messages = launch::node_messages(registry);
  const auto lines = [](const std::string& text) {
    return std::count(text.begin(), text.end(), '\n');
  };
  EXPECT_LE(lines(table), 1 + 50 + 1);
  EXPECT_LT(table.size(), 100'000u);
  EXPECT_LE(lines(messages), 200 + 1 + 20 + 1);
  EXPECT_LT(messages.size(), 50'000u);
  EXPECT_TRUE(contains(table, "more nodes"));
  EXPECT_TRUE(contains(messages, "more lines"));
  EXPECT_TRUE(contains(messages, "2 processes publish as node"));
  EXPECT_TRUE(contains(table, "\nsim ")) << table;
  EXPECT_TRUE(contains(messages, "sim: refused 7 messages from process 1000 on host alpha\n"));
}
