// The registry of statuses at its limits: sums, ties, silence, the number of nodes and processes.
#include <gtest/gtest.h>

#include "launch/supervise/status/node_status.h"
#include "tests/launch/supervise/statuses.h"
#include "tests/support/time_units.h"

using namespace fivepipe;
using namespace fivepipe::test;

TEST(StatusRegistry, CpuPercentNeedsTimeBetweenTwoStatuses) {
  launch::StatusRegistry registry;
  EXPECT_EQ(registry.cpu_percent("sim"), 0) << "no status yet";
  auto one = status("sim", kFirst, 0);
  for (const double cpu_s : {1.0, 1.5, 2.5}) {
    one.cpu_s = cpu_s;
    registry.add(one, (cpu_s > 1 ? 11 : 10) * s);
  }
  EXPECT_DOUBLE_EQ(registry.cpu_percent("sim"), 50) << "the newest two arrived together";
  one.cpu_s = 3;
  registry.add(one, 13 * s);
  EXPECT_DOUBLE_EQ(registry.cpu_percent("sim"), 25);
}

TEST(StatusRegistry, AnOlderProcessIsADuplicateOnceItPublishesForLongerThanItsLastStatusTakes) {
  launch::StatusRegistry registry;
  registry.add(status("sim", kFirst, 1 * s), 10 * s);
  registry.add(status("sim", kSecond, 9 * s), 11 * s);
  registry.add(status("sim", kSecond, 9 * s), 12 * s);
  registry.add(status("sim", kFirst, 1 * s), 12 * s + s / 2);
  EXPECT_TRUE(registry.duplicates().empty());
  registry.add(status("sim", kFirst, 1 * s), 12 * s + s / 2 + 1);
  EXPECT_EQ(registry.duplicates().size(), 1u);
  auto last = status("sim", kFirst, 1 * s);
  last.final_report = true;
  registry.add(last, 14 * s);
  EXPECT_TRUE(registry.duplicates().empty()) << "the older one has ended";
}

// Hosts have different clocks, and a clock may be set back between two starts.
TEST(StatusRegistry, TheProcessThatAppearsLastIsTheNodeWhateverItsStart) {
  launch::StatusRegistry registry;
  for (const bus::ProcessId& process : {kSecond, kFirst, bus::ProcessId{"beta", 1, 1}})
    registry.add(status("sim", process, 1 * s), 10 * s);
  registry.add(status("sim", bus::ProcessId{"beta", 2, 1}, 0), 10 * s);
  std::string hosts;
  const auto processes = registry.processes();
  for (const auto& process : processes.at("sim")) hosts += bus::text_of(process.process) + "\n";
  EXPECT_EQ(hosts,
            "process 34 on host alpha\nprocess 12 on host alpha\nprocess 1 on host beta\n"
            "process 2 on host beta\n");
  EXPECT_EQ(registry.newest("sim")->process->pid, 2u);
}

TEST(StatusRegistry, AClockThatIsSetBackHidesNoSuccessor) {
  launch::StatusRegistry registry;
  auto dead = status("sim", kFirst, 3600 * s), successor = status("sim", kSecond, 1 * s);
  dead.cpu_s = 100;
  registry.add(dead, 10 * s);
  registry.add(successor, 11 * s);
  successor.cpu_s = 0.5;
  registry.add(successor, 12 * s);
  EXPECT_EQ(registry.newest("sim")->process, kSecond);
  EXPECT_EQ(registry.processes().at("sim").back().process, kSecond);
  EXPECT_DOUBLE_EQ(registry.activity("sim", 14 * s)->silent_s, 2);
  EXPECT_DOUBLE_EQ(registry.cpu_percent("sim"), 50);
  EXPECT_TRUE(registry.duplicates().empty());
}

// The network may deliver the last status of a dead process after the first one of its successor.
TEST(StatusRegistry, AProcessThatGoesOnIsNewerThanOneThatIsSilent) {
  launch::StatusRegistry registry;
  auto late = status("sim", kFirst, 1 * s);
  late.final_report = true;
  registry.add(status("sim", kSecond, 9 * s), 10 * s);
  registry.add(late, 10 * s + s / 2);
  registry.add(status("sim", kSecond, 9 * s), 12 * s);
  EXPECT_EQ(registry.newest("sim")->process, kFirst) << "1.5 s are not over";
  registry.add(status("sim", kSecond, 9 * s), 12 * s + 1);
  EXPECT_EQ(registry.newest("sim")->process, kSecond);
  const auto processes = registry.processes().at("sim");
  ASSERT_EQ(processes.size(), 2u);
  EXPECT_EQ(processes.front().process, kFirst);
  EXPECT_EQ(processes.back().process, kSecond);
  EXPECT_TRUE(registry.duplicates().empty());
}

TEST(StatusRegistry, KeepsEightProcessesAndAddsTheTotalsOfTheOldestToTheNext) {
  launch::StatusRegistry registry;
  const auto process_of = [](std::uint32_t pid) {
    auto one = status("sim", bus::ProcessId{"alpha", pid, 1}, pid * s);
    one.cpu_s = 10 * pid;
    one.memory_mb = 100 - pid;
    one.counts["frames"] = one.drops["late"] = one.empty_cameras["left"] = pid;
    one.topics["topic"] = {pid, 10 * pid, 100 * pid, 1000 * pid, 10000 * pid};
    one.collisions["ball"] = {pid, 10 * pid, 100 * pid};
    one.latencies["falling"] = {1.0 * pid, 2.0 * pid, 3.0 * pid, 4.0 * pid, 10 - pid};
    one.latencies["rising"] = one.latencies["falling"];
    one.latencies["rising"].count = pid;
    one.latencies["equal"] = one.latencies["falling"];
    one.latencies["equal"].count = 5;
    return one;
  };
  auto oldest = process_of(1);
  oldest.latencies["once"] = {7, 8, 9, 10, 1};
  oldest.latencies["never"] = {};
  registry.add(oldest, 10 * s);
  for (std::uint32_t pid = 2; pid <= 8; ++pid) registry.add(process_of(pid), 10 * s);
  EXPECT_EQ(registry.processes().at("sim").size(), 8u);
  registry.add(process_of(9), 10 * s);
  const auto kept = registry.processes().at("sim");
  ASSERT_EQ(kept.size(), 8u);
  EXPECT_EQ(kept[1].counts.at("frames"), 3u);
  const launch::ProcessStatus& sum = kept[0];
  EXPECT_EQ(sum.process->pid, 2u);
  EXPECT_EQ(sum.cpu_s, 30);
  EXPECT_EQ(sum.memory_mb, 99);
  for (const auto* counts : {&sum.counts, &sum.drops, &sum.empty_cameras})
    EXPECT_EQ(counts->begin()->second, 3u);
  const launch::TopicTotals& topic = sum.topics.at("topic");
  EXPECT_EQ((std::vector{topic.sent, topic.not_sent, topic.received, topic.recorded, topic.lost}),
            (std::vector<std::uint64_t>{3, 30, 300, 3000, 30000}));
  const launch::CollisionTotals& ball = sum.collisions.at("ball");
  EXPECT_EQ((std::vector{ball.frames, ball.points, ball.first_contacts}),
            (std::vector<std::uint64_t>{3, 30, 300}));
  EXPECT_EQ(sum.latencies.at("falling").p50_ms, 1) << "of the process that handled more frames";
  EXPECT_EQ(sum.latencies.at("rising").p50_ms, 2);
  EXPECT_EQ(sum.latencies.at("equal").p50_ms, 2);
  EXPECT_EQ(sum.latencies.at("once").p50_ms, 7);
  const launch::Latency& never = sum.latencies.at("never");
  EXPECT_EQ(never.p50_ms + never.p95_ms + never.p99_ms + never.max_ms + double(never.count), 0);
}

TEST(StatusRegistry, DropsTheLongestSilentProcessAndKeepsAnOldOneThatGoesOn) {
  launch::StatusRegistry registry;
  const auto counting = [](std::uint32_t pid, std::uint64_t frames) {
    auto one = status("sim", pid, 1 * s);
    one.counts["frames"] = frames;
    return one;
  };
  for (std::uint32_t pid = 1; pid <= 8; ++pid) registry.add(counting(pid, 1), 10 * s + pid);
  registry.add(counting(1, 5), 11 * s);
  registry.add(counting(9, 1), 12 * s);
  registry.add(counting(1, 7), 13 * s);
  const auto kept = registry.processes().at("sim");
  ASSERT_EQ(kept.size(), 8u);
  EXPECT_EQ(kept[0].process->pid, 1u);
  EXPECT_EQ(kept[0].counts.at("frames"), 7u) << "counted once";
  EXPECT_EQ(kept[1].process->pid, 3u);
  EXPECT_EQ(kept[1].counts.at("frames"), 2u) << "with that of process 2, which was silent longest";
}

TEST(StatusRegistry, AnOlderProcessStaysADuplicateAfterTheFinalReportOfTheNewerOne) {
  launch::StatusRegistry registry;
  registry.add(status("sim", kFirst, 1 * s), 10 * s);
  registry.add(status("sim", kSecond, 9 * s), 11 * s);
  auto last = status("sim", kSecond, 9 * s);
  last.final_report = true;
  registry.add(last, 12 * s);
  registry.add(status("sim", kFirst, 1 * s), 14 * s);
  ASSERT_EQ(registry.duplicates().size(), 1u);
  EXPECT_EQ(registry.duplicates()[0].processes,
            (std::vector<std::string>{"process 12 on host alpha", "process 34 on host alpha"}));
}

TEST(StatusRegistry, KeepsTotalsThatOnlyTheOldestProcessReported) {
  launch::StatusRegistry registry;
  auto oldest = status("sim", 1, 1 * s);
  oldest.topics["topic"] = {1, 2, 3, 4, 5};
  oldest.collisions["ball"] = {6, 7, 8};
  oldest.empty_cameras["left"] = 9;
  oldest.drops["late"] = 10;
  registry.add(oldest, 10 * s);
  for (std::uint32_t pid = 2; pid <= 9; ++pid) registry.add(status("sim", pid, pid * s), 10 * s);
  const auto processes = registry.processes().at("sim");
  ASSERT_EQ(processes.size(), 8u);
  const launch::ProcessStatus& next = processes[0];
  const launch::TopicTotals& topic = next.topics.at("topic");
  EXPECT_EQ((std::vector{topic.sent, topic.not_sent, topic.received, topic.recorded, topic.lost}),
            (std::vector<std::uint64_t>{1, 2, 3, 4, 5}));
  const launch::CollisionTotals& ball = next.collisions.at("ball");
  EXPECT_EQ((std::vector{ball.frames, ball.points, ball.first_contacts}),
            (std::vector<std::uint64_t>{6, 7, 8}));
  EXPECT_EQ(next.empty_cameras.at("left"), 9u);
  EXPECT_EQ(next.drops.at("late"), 10u);
  // The other fields are those of the process itself, which has counted nothing.
  EXPECT_FALSE(next.has_handled_frame || next.final_report);
  EXPECT_EQ(next.cpu_s + next.memory_mb + next.frame_rate_hz + double(next.frame), 0);
}

TEST(StatusRegistry, SumsHave256NamesAndTheFurtherOnesCountAsOther) {
  launch::StatusRegistry registry;
  auto oldest = status("sim", kFirst, 1);
  oldest.counts = {{"000", 5}, {"x", 7}, {"y", 11}, {"z", 13}};
  registry.add(oldest, 10 * s);
  for (int start = 2; start <= 9; ++start) {
    auto one = status("sim", kFirst, start);
    for (int i = 0; i < 255; ++i) {
      const std::string digits = std::to_string(i);
      one.counts[std::string(3 - digits.size(), '0') + digits] = 1;
    }
    registry.add(one, 10 * s);
  }
  auto counts = registry.processes().at("sim").front().counts;
  EXPECT_EQ(counts.size(), 257u);
  EXPECT_EQ(counts["000"], 6u);
  EXPECT_EQ(counts["x"], 7u);
  EXPECT_EQ(counts["other"], 24u);
}

TEST(StatusRegistry, AProcessPublishesAsAtMostSixtyFourNodes) {
  launch::StatusRegistry registry;
  for (int i = 0; i < 64; ++i) registry.add(status("node_" + std::to_string(i), kFirst, s), 10 * s);
  EXPECT_EQ(registry.ignored(), 0u);
  registry.add(status("node_64", kFirst, s), 100 * s);
  EXPECT_EQ(registry.ignored(), 1u);
  registry.add(status("node_63", kFirst, s), 100 * s);
  EXPECT_EQ(registry.ignored(), 1u) << "a known node";
  EXPECT_EQ(registry.processes().size(), 64u);
}

TEST(StatusRegistry, OnlyAnInactiveNodeMakesSpaceTheLongestSilentOneFirst) {
  const auto full = [](bool ended) {
    launch::StatusRegistry registry;
    for (std::uint32_t i = 0; i < 256; ++i) {
      auto one = status("node_" + std::to_string(100 + i), bus::ProcessId{"alpha", i, 1}, s);
      one.final_report = ended && i == 200;
      registry.add(one, (i == 30 || i == 40 ? 9 : 10) * s);
    }
    return registry;
  };
  launch::StatusRegistry registry = full(false);
  EXPECT_EQ(registry.processes().size(), 256u);
  registry.add(status("sim", kSecond, s), 11 * s);
  EXPECT_FALSE(registry.newest("sim")) << "a node may be silent for two seconds";
  EXPECT_EQ(registry.ignored(), 1u);
  registry.add(status("sim", kSecond, s), 12 * s);
  EXPECT_TRUE(registry.newest("sim"));
  EXPECT_FALSE(registry.newest("node_130")) << "the first of two that are silent longest";
  EXPECT_TRUE(registry.newest("node_140"));
  EXPECT_EQ(registry.processes().size(), 256u);

  registry = full(true);
  registry.add(status("sim", kSecond, s), 10 * s);
  EXPECT_TRUE(registry.newest("sim"));
  EXPECT_FALSE(registry.newest("node_300")) << "has ended";
  EXPECT_TRUE(registry.newest("node_130"));
}

TEST(StatusRegistry, ActivityIsTheTimeSinceTheNewestStatus) {
  launch::StatusRegistry registry;
  EXPECT_FALSE(registry.activity("sim", 10 * s));
  registry.add(status("sim", kFirst, 1 * s), 10 * s);
  registry.add(status("sim", kFirst, 1 * s), 11 * s);
  EXPECT_DOUBLE_EQ(registry.activity("sim", 14 * s)->silent_s, 3);
  EXPECT_FALSE(registry.activity("sim", 14 * s)->ended);
}
