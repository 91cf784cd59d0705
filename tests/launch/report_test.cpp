#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "launch/supervise/report.h"

using namespace fivepipe;

namespace {

constexpr std::int64_t s = 1'000'000'000;

launch::ProcessStatus status(const std::string& node, std::uint32_t pid,
                             std::int64_t start_stamp_ns) {
  launch::ProcessStatus status;
  status.node = node;
  status.process = bus::ProcessId{"alpha", pid, pid};
  status.start_stamp_ns = start_stamp_ns;
  return status;
}

// Ten seconds of a pipeline at 30 Hz. The first frame is composited after 0.5 s. recon_b was killed
// once.
launch::ReportInput ten_seconds() {
  launch::ReportInput input;
  input.start_stamp_ns = 100 * s;
  input.stop_stamp_ns = 110 * s;
  input.first_composited_stamp_ns = 100 * s + s / 2;
  input.programs = {{"capture", "capture_node", {{11, 100 * s, "exit code 0 (exited cleanly)"}}},
                    {"recon_a", "recon_node", {{12, 100 * s, "exit code 0 (exited cleanly)"}}},
                    {"recon_b",
                     "recon_node",
                     {{13, 100 * s, "killed by signal 9 (SIGKILL)"},
                      {17, 104 * s, "exit code 0 (exited cleanly)"}}},
                    {"sim", "sim_node", {{14, 100 * s, "exit code 0 (exited cleanly)"}}},
                    {"render", "render_node", {{15, 100 * s, "exit code 0 (exited cleanly)"}}}};
  auto capture = status("capture", 1, 100 * s);
  capture.counts = {{"frames_captured", 300}};
  capture.drops = {{"pipeline_busy", 4}};
  auto recon_a = status("recon_a", 2, 100 * s);
  recon_a.counts = {{"frame_sets_complete", 295}};
  recon_a.drops = {{"incomplete_set", 2}};
  auto recon_b_dead = status("recon_b", 3, 100 * s), recon_b = status("recon_b", 7, 104 * s);
  recon_b_dead.counts = {{"frame_sets_complete", 110}};
  recon_b_dead.latencies["reconstruct"] = {1, 2, 3, 4, 110};
  recon_b.counts = {{"frame_sets_complete", 175}};
  recon_b.drops = {{"incomplete_set", 1}};
  recon_b.latencies["reconstruct"] = {1.5, 2.5, 3.5, 4.5, 175};
  recon_b.empty_cameras["left"] = 3;
  recon_a.empty_cameras["right"] = 1;
  auto sim = status("sim", 4, 100 * s);
  sim.counts = {{"frame_sets_complete", 3}};
  sim.collisions = {{"ball", {42, 4200, 0}}, {"box", {0, 0, 2}}};
  sim.topics["fivepipe/v1/VirtualState"] = {.sent = 280, .not_sent = 6};
  auto render = status("render", 5, 100 * s);
  render.counts = {{"frames_composited", 286}};
  render.latencies["capture_to_composite"] = {12, 20, 31, 50, 286};
  render.gl_renderer = "llvmpipe, OpenGL 4.5";
  render.diagnostics = {"hull: empty"};
  render.cpu_s = 5;
  for (auto* of : {&capture, &recon_a, &recon_b, &sim, &render}) of->final_report = true;
  for (const auto& of : {capture, recon_a, recon_b_dead, recon_b, sim, render})
    input.statuses.add(of, 110 * s);
  return input;
}

}  // namespace

TEST(Report, CountsFramesOverAllProcessesOfANode) {
  const auto report = launch::report_from(ten_seconds());
  EXPECT_EQ(report["frames"]["captured"], 300);
  EXPECT_EQ(report["frames"]["complete"], 285)
      << "the sum of recon_b's processes; sim_node's sets do not count";
  EXPECT_EQ(report["frames"]["composited"], 286);
  EXPECT_EQ(report["frames"]["dropped"],
            (nlohmann::json{{"pipeline_busy", 4}, {"incomplete_set", 3}}));
  EXPECT_EQ(report["nodes"]["recon_b"]["counts"]["frame_sets_complete"], 285);
}

TEST(Report, CountsTheDropsOfUp) {
  auto input = ten_seconds();
  input.drops["bad_composited: viewer: timestamp before 1970 or after 2200"] = 5;
  EXPECT_EQ(
      launch::report_from(input)["frames"]["dropped"]
                                ["bad_composited: viewer: timestamp before 1970 or after 2200"],
      5);
}

TEST(Report, FrameRateIsMeasuredFromTheFirstCompositedFrame) {
  EXPECT_DOUBLE_EQ(launch::report_from(ten_seconds())["frame_rate_hz"].get<double>(), 285 / 9.5);
  EXPECT_DOUBLE_EQ(launch::report_from(ten_seconds())["duration_s"].get<double>(), 10);
}

TEST(Report, LatencyIsCaptureToComposite) {
  const auto latency = launch::report_from(ten_seconds())["latency_ms"];
  EXPECT_EQ(latency["p50"], 12);
  EXPECT_EQ(latency["p95"], 20);
  EXPECT_EQ(latency["p99"], 31);
  EXPECT_EQ(latency["max"], 50);
}

TEST(Report, RestartsIncludeCauses) {
  const auto node = launch::report_from(ten_seconds())["nodes"]["recon_b"];
  EXPECT_EQ(node["pids"], (nlohmann::json{13, 17}));
  ASSERT_EQ(node["restarts"].size(), 1u);
  EXPECT_EQ(node["restarts"][0]["cause"], "killed by signal 9 (SIGKILL)");
  EXPECT_EQ(node["latencies_ms"]["reconstruct"]["p50"], 1.5)
      << "those of the process that handled most frames";
}

TEST(Report, ListsCollisionsAndEmptyHulls) {
  const auto report = launch::report_from(ten_seconds());
  EXPECT_EQ(report["collisions"]["ball"],
            (nlohmann::json{{"frames", 42}, {"points", 4200}, {"first_contacts", 0}}));
  EXPECT_EQ(report["collisions"]["box"]["frames"], 0);
  EXPECT_EQ(report["collisions"]["box"]["first_contacts"], 2);
  EXPECT_EQ(report["empty_cameras"], (nlohmann::json{"left", "right"}));
  EXPECT_EQ(report["machine"]["gl_renderer"], "llvmpipe, OpenGL 4.5");
  EXPECT_EQ(report["nodes"]["render"]["diagnostics"], nlohmann::json({"hull: empty"}));
  EXPECT_EQ(report["nodes"]["sim"]["topics"]["fivepipe/v1/VirtualState"]["not_sent"], 6);
}

TEST(Report, NamesTheSendersOfRefusedMessages) {
  auto input = ten_seconds();
  for (const auto& [node, pid] : {std::pair{"recon_a", 2}, {"sim", 4}}) {
    auto newer = status(node, std::uint32_t(pid), 100 * s);
    newer.final_report = true;
    newer.counts = {{"refused from process 99 on host beta", 1000}};
    input.statuses.add(newer, 111 * s);
  }
  const auto report = launch::report_from(input);
  EXPECT_EQ(report["refused_from"], (nlohmann::json{{"process 99 on host beta", 2000}}));
  EXPECT_NE(launch::table_of(report).find("refused: 2000 messages from process 99 on host beta\n"),
            std::string::npos);
}

// A process with the name of a node can report any drops.
TEST(Report, IsBoundedForInventedDrops) {
  auto input = ten_seconds();
  constexpr int kProcesses = 60, kDrops = 250;
  for (int process = 0; process < kProcesses; ++process) {
    auto peer = status("sim", std::uint32_t(1000 + process), (200 + process) * s);
    for (int i = 0; i < kDrops; ++i) {
      const std::string invented = std::to_string(process) + "_" + std::to_string(i);
      peer.drops["bad_map: invented_" + invented] = 2;
      peer.counts["invented_" + invented] = 2;
    }
    input.statuses.add(peer, 111 * s);
  }
  const auto report = launch::report_from(input);
  EXPECT_LT(report.dump(2).size(), 50'000u);
  std::uint64_t drops = 0;
  for (const auto& [reason, count] : report["nodes"]["sim"]["drops"].items())
    drops += count.get<std::uint64_t>();
  EXPECT_GE(drops, std::uint64_t(2 * kProcesses * kDrops)) << "the others count together";
  const std::string table = launch::table_of(report);
  EXPECT_LT(std::count(table.begin(), table.end(), '\n'), 150);
}

TEST(Report, APeersTextNeitherControlsTheTerminalNorFillsTheTable) {
  auto input = ten_seconds();
  auto peer = status("sim", 99, 200 * s);
  for (int i = 0; i < 250; ++i) {
    const std::string name = "\x1b[2J" + std::to_string(i);
    peer.drops["bad_map: " + name] = peer.empty_cameras[name] = 1;
    peer.counts["refused from " + name] = 1;
    peer.collisions[name].frames = 1;
  }
  input.statuses.add(peer, 111 * s);
  const std::string table = launch::table_of(launch::report_from(input));
  for (const char c : table) EXPECT_TRUE(c >= ' ' || c == '\n') << int(c);
  EXPECT_LT(std::count(table.begin(), table.end(), '\n'), 4 * 66 + 20);
  EXPECT_NE(table.find("collided: 188 more\n"), std::string::npos) << table;  // of 252
  EXPECT_NE(table.find("hull empty: 188 more\n"), std::string::npos) << table;
}

// Otherwise rare reasons would vanish among many subjects of others.
TEST(Report, KeepsTheSumOfEachReason) {
  auto input = ten_seconds();
  auto sim = status("sim", 4, 100 * s);
  for (int i = 0; i < 200; ++i) sim.drops["bad_map: invented_" + std::to_string(i)] = 5;
  sim.drops["bad_pose: viewer: not finite"] = 2;
  sim.drops["video_frame"] = 1;
  input.statuses.add(sim, 111 * s);
  const auto report = launch::report_from(input);
  for (const nlohmann::json& drops :
       {report["nodes"]["sim"]["drops"], report["frames"]["dropped"]}) {
    std::map<std::string, std::uint64_t> by_reason;
    for (const auto& [text, count] : drops.items())
      by_reason[text.substr(0, text.find(':'))] += count.get<std::uint64_t>();
    EXPECT_EQ(by_reason["bad_map"], 1000u) << drops;
    EXPECT_EQ(by_reason["bad_pose"], 2u) << drops;
    EXPECT_EQ(by_reason["video_frame"], 1u) << drops;
    EXPECT_FALSE(by_reason.contains("other")) << drops;
    EXPECT_LE(drops.size(), 64u + 32u);
  }
}

TEST(Report, MarksNonFinalStatuses) {
  launch::ReportInput input = ten_seconds();
  input.statuses = {};
  auto sim = status("sim", 4, 100 * s);
  input.statuses.add(sim, 103 * s);
  const auto report = launch::report_from(input);
  EXPECT_EQ(report["nodes"]["sim"]["status"], "last status before it died");
  EXPECT_EQ(report["nodes"]["render"]["status"], "none received");
}

// DDS gives a process a new publication handle after a silence longer than the lease.
TEST(Report, CountsAProcessOnceThatWasSilentForLongerThanItsLease) {
  launch::ReportInput input = ten_seconds();
  auto render = status("render", 5, 100 * s);
  render.counts = {{"frames_composited", 290}};
  render.final_report = true;
  input.statuses.add(render, 117 * s);
  const auto report = launch::report_from(input);
  EXPECT_EQ(report["frames"]["composited"], 290);
  EXPECT_EQ(report["duplicate_nodes"], nlohmann::json::array());
}

TEST(Report, NamesDuplicateNodes) {
  launch::ReportInput input = ten_seconds();
  auto foreign = status("render", 99, 50 * s);
  input.statuses.add(foreign, 115 * s);
  EXPECT_EQ(launch::report_from(input)["duplicate_nodes"], nlohmann::json({"render"}));
}

TEST(Report, DescribesTheRecorder) {
  launch::ReportInput input = ten_seconds();
  EXPECT_TRUE(launch::report_from(input)["recorder"].is_null());
  input.recorder = {"session.mcap", "recorder_7", 9, "exit code 0 (exited cleanly)", true, {}};
  auto recorder = status("recorder_7", 9, 99 * s);
  recorder.topics["a"] = {.received = 5, .recorded = 4, .lost = 1};
  recorder.topics["b"] = {.received = 20, .recorded = 20};
  recorder.drops["lost: a"] = 1;
  input.statuses.add(recorder, 110 * s);
  const auto report = launch::report_from(input);
  EXPECT_EQ(report["recorder"], (nlohmann::json{{"file", "session.mcap"},
                                                {"pid", 9},
                                                {"end", "exit code 0 (exited cleanly)"},
                                                {"complete", true},
                                                {"ended_after_s", nullptr},
                                                {"received", 25},
                                                {"recorded", 24},
                                                {"lost", 1}}));
  EXPECT_FALSE(report["nodes"].contains("recorder_7"));
  EXPECT_FALSE(report["frames"]["dropped"].contains("lost: a")) << "no frame of a node";
  EXPECT_EQ(launch::table_of(report).find("recording"), std::string::npos);
}

TEST(Report, StatesThatTheRecordingIsIncomplete) {
  launch::ReportInput input = ten_seconds();
  input.recorder = {"session.mcap", "recorder_7", 9, "killed by signal 9 (SIGKILL)", false, 3.21};
  const auto report = launch::report_from(input);
  EXPECT_EQ(report["recorder"]["ended_after_s"], 3.21);
  const std::string table = launch::table_of(report);
  EXPECT_NE(table.find("the recording is incomplete: session.mcap; 0 of 0 received messages "
                       "recorded; end of the recorder after 3.2 s: killed by signal 9 (SIGKILL)\n"),
            std::string::npos)
      << table;
}

TEST(Report, HasNoLatencyAndNoRateWithoutAFrame) {
  launch::ReportInput input = ten_seconds();
  input.statuses = {};
  input.first_composited_stamp_ns.reset();
  const auto report = launch::report_from(input);
  EXPECT_TRUE(report["latency_ms"].is_null());
  EXPECT_EQ(report["frame_rate_hz"], 0);
  EXPECT_EQ(report["frames"]["composited"], 0);
  EXPECT_FALSE(launch::table_of(report).empty());
}

TEST(Report, CpuPercentIsTheMeanSinceTheStart) {
  EXPECT_DOUBLE_EQ(
      launch::report_from(ten_seconds())["nodes"]["render"]["cpu_percent"].get<double>(), 50);
}

TEST(Report, TableShowsKeyFigures) {
  const std::string table = launch::table_of(launch::report_from(ten_seconds()));
  for (const char* part : {"30.0 frames/s", "286 composited", "incomplete_set", "p99 31.0",
                           "camera left", "SIGKILL", "ball"})
    EXPECT_NE(table.find(part), std::string::npos) << part << " is not in\n" << table;
}
