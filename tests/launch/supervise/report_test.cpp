#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "launch/supervise/report.h"
#include "tests/launch/supervise/statuses.h"
#include "tests/support/time_units.h"

using namespace fivepipe;
using namespace fivepipe::test;

namespace {

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

// The node of another host states its start by its own clock.
TEST(Report, TheClocksOfOtherHostsAreCompared) {
  auto input = ten_seconds();
  input.programs.back().other_host = "beta";
  launch::ComparedHost beta{{{"beta", "up"}, "beta.lab", "1 (abc)", {}, {}}, std::nullopt};
  launch::ComparedHost doctor = beta;
  doctor.state.speaker.program = "doctor";
  doctor.clock = launch::ClockOffset{7 * s, 0};
  input.hosts = {doctor, beta};
  auto report = launch::report_from(input);
  EXPECT_EQ(report["hosts"], nlohmann::json::parse(R"JSON(
    {"beta": {"clock_error_ms": null, "clock_offset_ms": null, "machine": "beta.lab",
              "version": "1 (abc)"}})JSON"));
  EXPECT_DOUBLE_EQ(report["nodes"]["render"]["cpu_percent"].get<double>(), 50);
  EXPECT_TRUE(contains(launch::table_of(report), "clock of host beta: not compared"));
  input.hosts[1].clock = launch::ClockOffset{-5 * s, 1'000'000};
  report = launch::report_from(input);
  EXPECT_DOUBLE_EQ(report["hosts"]["beta"]["clock_offset_ms"].get<double>(), -5000);
  EXPECT_DOUBLE_EQ(report["hosts"]["beta"]["clock_error_ms"].get<double>(), 1);
  EXPECT_DOUBLE_EQ(report["nodes"]["render"]["cpu_percent"].get<double>(), 100);
  EXPECT_TRUE(contains(launch::table_of(report),
                       "clock of host beta: 5000.00 ms behind (error at most 1.00 ms)"));
  input.hosts[1].clock = launch::ClockOffset{1'000'000, 0};
  EXPECT_FALSE(contains(launch::table_of(launch::report_from(input)), "clock of"));
}

TEST(Report, ALatencyBetweenClocksThatAreNotComparedIsUnknown) {
  const std::string text = "capture to composite: unknown, as the clocks of the hosts were not";
  EXPECT_FALSE(contains(launch::table_of(launch::report_from(ten_seconds())), text));
  auto input = ten_seconds();
  auto render = status("render", 5, 100 * s);
  render.latencies["capture_to_composite (clocks not compared)"] = {12, 20, 31, 50, 286};
  render.final_report = true;
  input.statuses.add(render, 110 * s);
  const auto report = launch::report_from(input);
  EXPECT_TRUE(report["latency_ms"].is_null());
  EXPECT_TRUE(contains(launch::table_of(report), text));
  // Nodes that have not sent a status have no latencies.
  input.statuses = {};
  EXPECT_FALSE(contains(launch::table_of(launch::report_from(input)), text));
}

TEST(Report, ANodeThatSimulatesHasItsMetrics) {
  auto input = ten_seconds();
  EXPECT_FALSE(launch::report_from(input)["nodes"]["sim"].contains("simulation"));
  input.simulations.add({"sim", {{"particles", {.count = 5}}}}, 1 * s);
  const auto report = launch::report_from(input);
  EXPECT_EQ(report["nodes"]["sim"]["simulation"],
            (nlohmann::json{{"particles", {{"count", 5}, {"hull_contacts", 0}}}}));
  EXPECT_FALSE(report["nodes"]["render"].contains("simulation"));
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
  input.statuses.add(status("render", 99, 50 * s), 115 * s);
  EXPECT_TRUE(launch::report_from(input)["duplicate_nodes"].empty()) << "it may be the successor";
  input.statuses.add(status("render", 5, 100 * s), 117 * s);
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
  EXPECT_EQ(report["frames"]["complete"], 0) << "of two recon_nodes without a status";
  EXPECT_FALSE(launch::table_of(report).empty());
  // `up` may miss the message of the first composited frame, but not the counts.
  input = ten_seconds();
  input.first_composited_stamp_ns.reset();
  EXPECT_EQ(launch::report_from(input)["frame_rate_hz"], 0);
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

namespace {

// Two seconds with a restarted node, a node on another host, refused messages, a recorder that
// failed, and a second process that publishes as the node sim.
launch::ReportInput two_seconds() {
  launch::ReportInput input;
  input.version = "0.1.0";
  input.commit = "abc";
  input.build_type = "Release";
  input.cpu = "fast";
  input.cores = 8;
  input.deployment = "demo.yaml";
  input.start_stamp_ns = 100 * s;
  input.stop_stamp_ns = 102 * s;
  input.first_composited_stamp_ns = 101 * s + s / 2;
  input.ended_by = "duration";
  input.drops = {{"bad_composited", 1}, {"late", 2}};
  input.programs = {{"recon", "recon_node", {{1, 100 * s, "killed"}, {2, 101 * s, "exit code 0"}}},
                    {"recon_b", "recon_node", {{3, 100 * s, "exit code 0"}}},
                    {"remote", "capture_node", {}},
                    {"render", "render_node", {{4, 100 * s, "exit code 0"}}},
                    {"render_b", "render_node", {{5, 102 * s, ""}}},
                    {"sim", "sim_node", {{6, 100 * s, "exit code 0"}}}};
  auto dead = status("recon", 1, 100 * s), recon = status("recon", 2, 101 * s),
       recon_b = status("recon_b", 3, 100 * s), render = status("render", 4, 100 * s),
       render_b = status("render_b", 5, 102 * s), sim = status("sim", 6, 90 * s),
       newer_sim = status("sim", 7, 100 * s), recorder = status("recorder_9", 9, 100 * s);
  dead.cpu_s = 0.5;
  dead.memory_mb = 90.4;
  recon.cpu_s = 0.25;
  recon.memory_mb = 80;
  dead.counts = recon.counts = {{"frame_sets_complete", 20}, {"refused from x", 3}};
  recon_b.counts = {{"frame_sets_complete", 39}};
  dead.drops = recon.drops = {{"late", 5}, {"not_sent: a", 1}};
  dead.topics["a"] = recon.topics["a"] = {1, 2, 3, 4, 5};
  dead.latencies["reconstruct"] = {1, 2, 3, 4, 20};
  recon.latencies["reconstruct"] = {5, 6, 7, 8, 20};
  dead.empty_cameras["left"] = 1;
  dead.diagnostics = {"old: text"};
  recon.diagnostics = {"hull: empty"};
  recon.final_report = true;
  render.counts = {{"frames_composited", 2}};
  render_b.counts = {{"frames_composited", 11}};
  render_b.cpu_s = 1;
  render.latencies["capture_to_composite"] = {10, 20, 30, 40, 1};
  render_b.latencies["capture_to_composite"] = {1, 2, 30, 4, 11};
  render_b.gl_renderer = "fast card";
  sim.collisions["ball"] = {3, 30, 1};
  newer_sim.collisions["ball"] = {1, 5, 0};
  sim.latencies["capture_to_composite"] = {};
  sim.latencies["capture_to_composite"].p99_ms = 99;
  recorder.topics["a"] = {0, 0, 10, 8, 2};
  for (const auto& one : {dead, recon, recon_b, render, render_b, sim, newer_sim, recorder})
    input.statuses.add(one, 101 * s);
  input.statuses.add(sim, 103 * s);
  input.recorder = {"a.mcap", "recorder_9", 9, "exit code 1 (failed)", false, 1.25};
  return input;
}

}  // namespace

TEST(Report, HasEveryField) {
  EXPECT_EQ(launch::report_from(two_seconds()), nlohmann::json::parse(R"JSON(
    {"build_type": "Release",
     "collisions": {"ball": {"first_contacts": 1, "frames": 4, "points": 35}}, "commit": "abc",
     "deployment": "demo.yaml", "duplicate_nodes": ["sim"], "duration_s": 2.0,
     "empty_cameras": ["left"], "ended_by": "duration", "frame_rate_hz": 2.0,
     "core_ms_per_set": null, "rate_bound": "",
     "frames": {"captured": 0, "complete": 39, "composited": 2,
      "dropped": {"bad_composited": 1, "late": 12, "not_sent: a": 2}},
     "hosts": {},
     "latency_ms": {"count": 1, "max": 40.0, "p50": 10.0, "p95": 20.0, "p99": 30.0},
     "machine": {"cores": 8, "cpu": "fast", "gl_renderer": "fast card"},
     "nodes": {"recon": {"counts": {"frame_sets_complete": 40, "refused from x": 6},
      "cpu_percent": 25.0,
       "cpu_s": 0.75, "diagnostics": ["hull: empty"], "drops": {"late": 10, "not_sent: a": 2},
       "end": "exit code 0",
       "latencies_ms": {"reconstruct": {"count": 20, "max": 4.0, "p50": 1.0, "p95": 2.0,
        "p99": 3.0}},
       "memory_mb": 90.4, "pids": [1, 2], "program": "recon_node",
       "restarts": [{"cause": "killed", "pid": 2}], "status": "final report",
       "topics": {"a": {"lost": 10, "not_sent": 4, "received": 6, "recorded": 8, "sent": 2}}},
      "recon_b": {"counts": {"frame_sets_complete": 39}, "cpu_percent": 0.0, "cpu_s": 0.0,
       "diagnostics": [],
       "drops": {}, "end": "exit code 0", "latencies_ms": {}, "memory_mb": 0.0, "pids": [3],
       "program": "recon_node", "restarts": [], "status": "last status before it died",
       "topics": {}},
      "remote": {"end": "not started here", "pids": [], "program": "capture_node", "restarts": [],
       "status": "none received"},
      "render": {"counts": {"frames_composited": 2}, "cpu_percent": 0.0, "cpu_s": 0.0,
       "diagnostics": [],
       "drops": {}, "end": "exit code 0",
       "latencies_ms": {"capture_to_composite": {"count": 1, "max": 40.0, "p50": 10.0,
        "p95": 20.0, "p99": 30.0}},
       "memory_mb": 0.0, "pids": [4], "program": "render_node", "restarts": [],
       "status": "last status before it died", "topics": {}},
      "render_b": {"counts": {"frames_composited": 11}, "cpu_percent": 0.0, "cpu_s": 1.0,
       "diagnostics": [],
       "drops": {}, "end": "",
       "latencies_ms": {"capture_to_composite": {"count": 11, "max": 4.0, "p50": 1.0, "p95": 2.0,
        "p99": 30.0}},
       "memory_mb": 0.0, "pids": [5], "program": "render_node", "restarts": [],
       "status": "last status before it died", "topics": {}},
      "sim": {"counts": {}, "cpu_percent": 0.0, "cpu_s": 0.0, "diagnostics": [], "drops": {},
       "end": "exit code 0",
       "latencies_ms": {"capture_to_composite": {"count": 0, "max": 0.0, "p50": 0.0, "p95": 0.0,
        "p99": 99.0}},
       "memory_mb": 0.0, "pids": [6], "program": "sim_node", "restarts": [],
       "status": "last status before it died", "topics": {}}},
     "recorder": {"complete": false, "end": "exit code 1 (failed)", "ended_after_s": 1.25,
      "file": "a.mcap",
      "lost": 2, "pid": 9, "received": 10, "recorded": 8},
     "refused_from": {"x": 6}, "version": "0.1.0"})JSON"));
}

TEST(Report, TableIsWordForWord) {
  EXPECT_EQ(launch::table_of(launch::report_from(two_seconds())),
            "2.0 s, 2.0 frames/s composited; frames: 0 captured, 39 complete, 2 composited\n"
            "  dropped: 1 bad_composited\n"
            "  dropped: 12 late\n"
            "  dropped: 2 not_sent: a\n"
            "  refused: 6 messages from x\n"
            "latency, capture to composite: p50 10.0, p95 20.0, p99 30.0, max 40.0 ms\n"
            "collided: ball, 4 frames, 35 points\n"
            "hull empty: camera left saw no object pixel\n"
            "the recording is incomplete: a.mcap; 8 of 10 received messages recorded; "
            "end of the recorder after 1.2 s: exit code 1 (failed)\n"
            "node      program       CPU %  memory MB  drops  restarts  note\n"
            "recon     recon_node       25         90     12         1\n"
            "recon_b   recon_node        0          0      0         0\n"
            "remote    capture_node      -          -      -         -  no status received; not "
            "started here\n"
            "render    render_node       0          0      0         0\n"
            "render_b  render_node       0          0      0         0\n"
            "sim       sim_node          0          0      0         0\n"
            "restarted: recon, killed\n");
}
