// How a run of `fivepipe up` ends, and what its report states; shell scripts replace the nodes.
#include <regex>

#include "common/base/machine.h"
#include "common/base/version.h"
#include "tests/launch/cli/up_fixture.h"
#include "tests/support/sanitizer.h"
#include "tests/support/text.h"

using namespace std::chrono_literals;
namespace fs = std::filesystem;

namespace fivepipe::test {
namespace {

const std::string kEndsAtOnce = "echo done\nexit 0\n";

// capture_node and render_node run on another host.
class UpWithoutRenderNode : public Up {
 protected:
  const fs::path deployment_ = folder_ / "dépl" / "two hosts.yaml";

  void SetUp() override {
    Up::SetUp();
    std::string text = replaced(text_of(FIVEPIPE_SOURCE_DIR "/launch/deployments/demo.yaml"),
                                "rig: ../..", "rig: " FIVEPIPE_SOURCE_DIR);
    text = replaced(text, "scene: ../..", "scene: " FIVEPIPE_SOURCE_DIR);
    for (const std::string program : {"capture_node", "render_node"})
      text = replaced(text, "program: " + program, "program: " + program + "\n    host: elsewhere");
    fs::create_directories(deployment_.parent_path());
    std::ofstream(deployment_) << text;
  }
  std::vector<std::string> words(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words = up_words("out", domain_, more);
    words[2] = deployment_;
    return words;
  }
  std::string end_of(const std::string& node) const { return report()["nodes"][node]["end"]; }
};

TEST_F(UpWithoutRenderNode, EndsWithItsNodesAndReportsTheRun) {
  write_nodes(kEndsAtOnce);
  // The folder is out/NAME of the working folder.
  Program& up = start({"/bin/sh", "-c", "cd \"$0\" && exec \"$@\"", folder_, folder_ / "fivepipe",
                       "up", deployment_, "--domain", std::to_string(domain_)},
                      "said");
  EXPECT_EQ(up.wait_for_end(kTimeout), 0) << up.said();
  EXPECT_TRUE(contains(up.said(), "report: out/demo/report.json, logs: out/demo/log/\n"))
      << up.said();
  EXPECT_EQ(contains(up.said(), "many times slower"), std::string(base::build_type()) != "Release");
  const std::string text = text_of(folder_ / "out" / "demo" / "report.json");
  EXPECT_TRUE(text.starts_with("{\n  \"build_type\": \"")) << text;
  EXPECT_TRUE(contains(text, "/dépl/two hosts.yaml\"")) << text;
  const auto report = nlohmann::json::parse(text);
  EXPECT_EQ(report["ended_by"], "every node ended");
  EXPECT_EQ(report["deployment"], deployment_.string());
  EXPECT_EQ(report["version"], base::version());
  EXPECT_EQ(report["commit"], base::commit());
  EXPECT_EQ(report["build_type"], base::build_type());
  EXPECT_EQ(report["machine"]["cpu"], base::cpu_name());
  EXPECT_EQ(report["machine"]["cores"], base::core_count());
  EXPECT_GT(report["duration_s"].get<double>(), 0);
  EXPECT_LT(report["duration_s"].get<double>(), 30);
  EXPECT_TRUE(report["recorder"].is_null());
  for (const std::string& node : nodes_) {
    const bool is_here = node != "capture" && node != "rendering";
    EXPECT_EQ(report["nodes"][node]["pids"].size(), is_here ? 1u : 0u) << node;
    EXPECT_EQ(report["nodes"][node]["end"],
              is_here ? "exit code 0 (exited cleanly)" : "not started here");
  }
  EXPECT_EQ(report["nodes"]["rendering"]["program"], "render_node");
}

// Long enough for the node to set its trap, even on a busy machine. Without a local render_node the
// duration counts from the start of `up`.
const std::vector<std::string> kForFiveSeconds = {"--duration", "5"};

TEST_F(UpWithoutRenderNode, ACrashAtTheEndOfTheDurationIsAFailure) {
  write_program("sim_node", "trap 'exit 4' TERM\necho up\nwhile :; do sleep 0.02; done\n");
  Program& up = start(words(kForFiveSeconds), "said");
  EXPECT_EQ(up.wait_for_end(kTimeout), 1) << up.said();
  EXPECT_EQ(report()["ended_by"], "duration");
  EXPECT_EQ(end_of("simulation"), "exit code 4");
  EXPECT_EQ(end_of("recon_a"), "killed by signal 15 (SIGTERM)");
}

// SIGINT shortens the time that a node has to end, but is not the reason.
TEST_F(UpWithoutRenderNode, TheFirstReasonToStopIsReported) {
  write_program("sim_node", "trap 'echo term' TERM\necho up\nwhile :; do sleep 0.02; done\n");
  Program& up = start(words(kForFiveSeconds), "said");
  ASSERT_TRUE(wait_for([&] { return contains(log_of("simulation"), "term\n"); })) << up.said();
  up.signal(SIGINT);
  EXPECT_EQ(up.wait_for_end(kTimeout), 130) << up.said();
  EXPECT_EQ(report()["ended_by"], "duration");
  EXPECT_EQ(end_of("simulation"), "killed by signal 9 (SIGKILL)");
}

TEST_F(Up, TheDurationCountsFromTheFirstCompositedFrame) {
  write_publishing_nodes();
  Program& up = start_up("out", {"--duration", "0.5"});
  EXPECT_EQ(up.wait_for_end(kTimeout), 0) << up.said();
  const auto report = this->report();
  EXPECT_EQ(report["ended_by"], "duration");
  EXPECT_GT(report["frames"]["composited"].get<int>(), 1);
  EXPECT_GT(report["frame_rate_hz"].get<double>(), 0);
  EXPECT_TRUE(report["frames"]["dropped"].empty()) << report["frames"];
}

TEST_F(Up, BeforeTheFirstFrameTheDurationIsNotOver) {
  // A node has more than a second to end. A sanitizer can delay the node for as long.
  write_program("sim_node",
                "trap 'sleep 0.05; exit 0' TERM\necho up\nwhile :; do sleep 0.02; done\n");
  Program& up = start_up("out", {"--duration", "0.1"});
  ASSERT_TRUE(all_nodes_run()) << up.said();
  up.signal(SIGTERM);
  EXPECT_EQ(up.wait_for_end(kTimeout), 130) << up.said();
  EXPECT_EQ(report()["ended_by"], "SIGTERM");
  if (!kHasSanitizer) {
    EXPECT_EQ(report()["nodes"]["simulation"]["end"], "exit code 0 (exited cleanly)");
  }
}

TEST_F(Up, EndsWithEveryRenderNode) {
  write_program("render_node", kEndsAtOnce);
  Program& up = start_up();
  EXPECT_EQ(up.wait_for_end(kTimeout), 1) << "no frame was composited";
  EXPECT_EQ(report()["ended_by"], "every render_node ended");
}

TEST_F(Up, AReportThatCannotBeWrittenIsAnError) {
  Program& up = start_up();
  ASSERT_TRUE(all_nodes_run()) << up.said();
  const fs::path file = folder_ / "out" / "report.json";
  fs::create_symlink("/dev/full", file);
  up.signal(SIGINT);
  EXPECT_EQ(up.wait_for_end(kTimeout), 1) << up.said();
  EXPECT_TRUE(contains(up.said(), "cannot write " + file.string() + ": No space left on device"))
      << up.said();
}

TEST_F(Up, WrongFramesOfItsViewerAreCountedAsDrops) {
  bus::Bus bus({.domain = domain_, .deployment = "demo"});
  auto composited = bus.writer<bus::topics::FrameComposited>();
  Program& up = start_up();
  ASSERT_TRUE(all_nodes_run()) << up.said();
  ASSERT_TRUE(eventually(bus, kTimeout, [&] { return composited.readers() == 1; }));
  for (const std::string viewer : {"viewer", "another", "viewer"}) {
    fivepipe_v1_FrameComposited frame{};
    viewer.copy(frame.viewer, viewer.size());
    frame.composited_stamp_ns = -1;
    composited.write(frame);
  }
  ASSERT_TRUE(composited.wait_for_delivery(kTimeout));
  up.signal(SIGINT);
  EXPECT_EQ(up.wait_for_end(kTimeout), 130) << up.said();
  EXPECT_EQ(report()["frames"]["dropped"],
            (nlohmann::json{{"bad_composited: viewer: timestamp before 1970 or after 2200", 2}}));
}

TEST_F(Up, ARecorderThatDoesNotStartIsReportedWithItsOutput) {
  Program& up =
      start_up("out", {"--record", folder_ / "a.mcap", "--record-option=--topics=no_such_topic"});
  EXPECT_EQ(up.wait_for_end(kTimeout), 1) << up.said();
  EXPECT_TRUE(contains(up.said(), "the recorder did not start\n  no topic matches 'no_such_topic'"))
      << up.said();
  EXPECT_FALSE(fs::exists(folder_ / "out" / "log")) << "no node is started";
}

TEST_F(Up, ARecorderThatFailsMakesTheRecordingIncomplete) {
  Program& up =
      start_up("out", {"--record", folder_ / "a.mcap", "--record-option=--topics=HeadPose",
                       "--record-option=--duration=0.1"});
  ASSERT_TRUE(says(up, "the recorder ended while the deployment runs: exit code 1 (failed)"))
      << up.said();
  up.signal(SIGINT);
  EXPECT_EQ(up.wait_for_end(kTimeout), 1) << up.said();
  EXPECT_TRUE(contains(up.said(), "[recorder] received no message")) << up.said();
  EXPECT_FALSE(report()["recorder"]["complete"].get<bool>());
}

}  // namespace
}  // namespace fivepipe::test
