// `fivepipe bench pipeline` over real processes: what it measures, and that the account of the
// nodes agrees with the times of their messages on the loopback interface.
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>

#include "tests/support/optional_package.h"
#include "tests/support/recording/recordings.h"
#include "tests/support/sanitizer.h"

namespace fivepipe::test {
namespace {

using nlohmann::json;

bool is_long() { return std::getenv("FIVEPIPE_LONG") != nullptr; }

class BenchPipeline : public RecordingTest {
 protected:
  // Returns the result file. `said_` is the output.
  json bench(std::vector<std::string> words) {
    const auto file = folder_ / "result.json";
    words.insert(words.begin(),
                 {std::string(FIVEPIPE_BINARY_DIR) + "/fivepipe", "bench", "pipeline"});
    words.insert(words.end(), {"--json", file.string()});
    Program program(words, folder_ / "bench.log");
    EXPECT_EQ(program.wait_for_end(std::chrono::minutes(3)), 0) << program.said();
    said_ = program.said();
    return json::parse(text_of(file))["results"];
  }
  std::string said_;
};

// Returns the entries whose name begins with `prefix`, by the rest of the name.
std::map<std::string, json> entries_of(const json& results, const std::string& prefix) {
  std::map<std::string, json> entries;
  for (const json& result : results)
    if (const std::string name = result["name"]; name.starts_with(prefix))
      entries[name.substr(prefix.size())] = result;
  return entries;
}

// Every stage was measured in every frame, and also from outside.
void expect_stages(const std::map<std::string, json>& entries,
                   const std::vector<std::string>& stages, std::uint64_t min_frames) {
  const std::uint64_t frames = entries.at("latency")["time_ms"]["runs"];
  EXPECT_GE(frames, min_frames);
  for (const std::string& stage : stages) {
    ASSERT_TRUE(entries.contains(stage)) << stage;
    EXPECT_EQ(entries.at(stage)["time_ms"]["runs"], frames) << stage;
  }
  EXPECT_GE(entries.at("outside/all stages")["counts"]["frames"], frames * 9 / 10);
}

// Timings hold in the build that is measured, not with a sanitizer.
void expect_agreement(const std::map<std::string, json>& entries, const std::string& said) {
  for (const auto& [name, entry] : entries)
    if (name.starts_with("outside/") && !kHasSanitizer) {
      EXPECT_TRUE(entry["counts"]["agrees"]) << name << '\n' << said;
    }
}

const std::vector<std::string> kAfterCapture = {"reconstruction busy with frames before",
                                                "bus to reconstruction",
                                                "reconstruction reads its inputs",
                                                "reconstruct",
                                                "write_tiles",
                                                "rendering busy with frames before",
                                                "bus to rendering",
                                                "waiting for the simulation",
                                                "rendering reads its inputs",
                                                "render"};

// Ten times the largest difference that agrees.
constexpr double kMinWait_ms = 3;

bool can_trace_loopback() {
  const int socket = ::socket(AF_PACKET, SOCK_RAW, 0);
  if (socket < 0) return false;
  ::close(socket);
  return true;
}

#define SKIP_WITHOUT_TRACE()                                                            \
  if (!can_trace_loopback())                                                            \
    FIVEPIPE_SKIP_WITHOUT_PACKAGE("needs CAP_NET_RAW to trace the loopback interface"); \
  EXPECT_EQ(said_.find("cannot trace the loopback interface"), std::string::npos) << said_

TEST_F(BenchPipeline, MeasuresAReplayWithoutCaptureNode) {
  const std::string deployment =
      is_long() ? FIVEPIPE_SOURCE_DIR "/launch/deployments/paper.yaml" : kSmallDeployment;
  const auto file = recorded(is_long() ? 3 : 2, deployment);
  for (const char* in_flight : {"1", "2"}) {
    const auto entries =
        entries_of(bench({"--from", file.string(), "--no-bus", "--in-flight", in_flight}),
                   is_long() ? "pipeline/paper/" : "pipeline/small/");
    EXPECT_NE(said_.find("WITHOUT capture_node"), std::string::npos) << said_;
    SKIP_WITHOUT_TRACE();
    std::vector<std::string> stages = kAfterCapture;
    stages.insert(stages.begin(), "send inputs");
    expect_stages(entries, stages, is_long() ? 100 : 5);
    if (is_long()) expect_agreement(entries, said_);
    if (!is_long()) return;
  }
}

// The simulation finds the hull's components in such small cells that the state of a frame is later
// than its tiles.
TEST_F(BenchPipeline, MeasuresTheWaitForASlowSimulation) {
  const std::string scene = FIVEPIPE_SOURCE_DIR "/scenes/demo/scene.yaml";
  const std::string deployment = changed_deployment(folder_ / "files", scene, "scene.yaml");
  std::ofstream(folder_ / "files/scene.yaml") << text_of(scene) << "history: {cell_m: 0.0025}\n";
  const auto file = recorded(is_long() ? 8 : 2, deployment);
  const auto entries = entries_of(bench({"--from", file.string(), "--no-bus", "--in-flight", "1"}),
                                  "pipeline/small/");
  SKIP_WITHOUT_TRACE();
  const std::string waiting = "waiting for the simulation";
  for (const std::string& name : {waiting, "outside/" + waiting})
    ASSERT_TRUE(entries.contains(name)) << name << '\n' << said_;
  EXPECT_GT(entries.at(waiting)["time_ms"]["median"], kMinWait_ms) << said_;
  const json& checked = entries.at("outside/" + waiting)["counts"];
  EXPECT_GT(checked["nodes_mean_ms"], kMinWait_ms) << said_;
  EXPECT_GT(checked["outside_mean_ms"], kMinWait_ms) << said_;
  if (is_long()) expect_agreement(entries, said_);
}

// capture_node reads the images from files, faster than the pipeline, so that it captures each
// frame at once after the one before.
TEST_F(BenchPipeline, MeasuresCaptureNodeWithFiles) {
  const std::string paper = FIVEPIPE_SOURCE_DIR "/launch/deployments/paper.yaml";
  const auto images = folder_ / "images";
  Program footage(
      {std::string(FIVEPIPE_BINARY_DIR) + "/fivepipe_footage", is_long() ? paper : kSmallDeployment,
       "--out", images.string(), "--frames", is_long() ? "120" : "5"},
      folder_ / "footage.log");
  ASSERT_EQ(footage.wait_for_end(std::chrono::minutes(1)), 0) << footage.said();
  std::map<std::string, json> entries;
  if (is_long()) {
    entries = entries_of(
        bench({"--deployment", FIVEPIPE_SOURCE_DIR "/launch/deployments/paper_files.yaml", "--set",
               "images=" + images.string(), "--duration", "8"}),
        "pipeline_with_capture/paper_files/");
  } else {
    std::string sources = "sources: {";
    for (const char* camera : {"left", "far", "right"})
      sources += std::string(camera) + ": {video: '" + (images / camera / "%04d.jpg").string() +
                 "', background: '" + (images / camera / "background_%02d.jpg").string() + "'}, ";
    entries = entries_of(
        bench({"--deployment",
               changed_deployment(folder_ / "files", "sources: synthetic,", sources + "},"),
               "--duration", "1"}),
        "pipeline_with_capture/small/");
  }
  EXPECT_NE(said_.find("with capture_node from image files"), std::string::npos) << said_;
  SKIP_WITHOUT_TRACE();
  std::vector<std::string> stages = kAfterCapture;
  stages.insert(stages.begin(), {"capture", "publish"});
  expect_stages(entries, stages, is_long() ? 60 : 5);
  EXPECT_GT(entries.at("capture")["time_ms"]["median"], 0);
  if (!is_long()) return;
  EXPECT_TRUE(entries.contains("outside/capture")) << "no frame began at once after another";
  expect_agreement(entries, said_);
}

}  // namespace
}  // namespace fivepipe::test
