// The whole pipeline with real processes and DDS.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <set>
#include <sstream>

#include "common/config/deployment.h"
#include "common/pipeline/messages/camera_messages.h"
#include "common/pipeline/node/status_names.h"
#include "tests/support/capture/pictures.h"
#include "tests/support/deployments.h"
#include "tests/support/process.h"
#include "tests/support/sanitizer.h"
#include "tests/support/test_domain.h"
#include "tests/support/text.h"

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// Time for five processes to start on a busy machine; two of them compile shaders.
constexpr auto kStart = 60s;
// Time until a killed node has restarted and frames are composited again.
constexpr std::chrono::milliseconds kRecovery = 10s * kSlowdown;

class Pipeline : public testing::Test {
 protected:
  std::uint32_t domain_ = test::own_domain();
  std::filesystem::path out_ =
      std::filesystem::temp_directory_path() / ("fivepipe_test_" + std::to_string(getpid()));
  bus::Bus bus_{{domain_}};
  bus::Reader<bus::topics::FrameComposited> composited_ =
      bus_.reader<bus::topics::FrameComposited>();
  bus::Reader<bus::topics::NodeStatus> statuses_ = bus_.reader<bus::topics::NodeStatus>();
  std::uint64_t frames_seen_ = 0;
  std::map<std::string, std::map<std::string, std::uint64_t>> drops_;  // by node and text

  ~Pipeline() override { std::filesystem::remove_all(out_); }

  void listen() {
    for (const auto& sample : composited_.take()) frames_seen_ += sample.valid();
    for (const auto& sample : statuses_.take()) {
      if (!sample.valid()) continue;
      for (const fivepipe_v1_DropCount& drop : messages::span_of(sample->drops))
        drops_[sample->node][messages::text_of({drop.reason, drop.subject, drop.detail})] =
            drop.count;
    }
  }
  // Whether `more` frames are composited within `timeout`.
  bool frames_go_on(std::uint64_t more, std::chrono::milliseconds timeout) {
    listen();
    const std::uint64_t target = frames_seen_ + more;
    return eventually(bus_, timeout, [&] {
      listen();
      return frames_seen_ >= target;
    });
  }
  std::string log() const {
    std::ifstream file(out_ / "up.log");
    return {std::istreambuf_iterator<char>(file), {}};
  }
};

TEST_F(Pipeline, CompositesReportsAndExitsCleanly) {
  const auto start = Clock::now();
  Deployed deployed(kSmallDeployment, domain_, out_, {"--duration", "8"});
  ASSERT_TRUE(frames_go_on(20, kStart)) << log();
  ASSERT_EQ(deployed.wait_for_end(40s), 0) << log();
  // A line about the state every 5 s, and one whenever rendering stops.
  int states = 0;
  std::istringstream lines(log());
  for (std::string line; std::getline(lines, line);)
    states += contains(line, " s: ") && contains(line, "frames composited");
  EXPECT_GE(states, 1) << log();
  EXPECT_LE(states, (Clock::now() - start) / 5s + 2) << log();
  const auto report = nlohmann::json::parse(std::ifstream(out_ / "report.json"));
  EXPECT_GE(report["frames"]["composited"].get<int>(), 20);
  EXPECT_GE(report["frames"]["captured"].get<int>(), report["frames"]["composited"].get<int>());
  EXPECT_GT(report["latency_ms"]["p50"].get<double>(), 0);
  EXPECT_FALSE(report["collisions"].empty());
  for (const std::string& node : kNodes)
    EXPECT_GT(report["nodes"][node]["cpu_s"].get<double>(), 0) << node;
  const cv::Mat still = cv::imread(out_ / "composite.png");
  EXPECT_EQ(still.size(), cv::Size(320, 240));
  cv::VideoCapture video((out_ / "composite.mp4").string(), cv::CAP_FFMPEG);
  ASSERT_TRUE(video.isOpened());
  EXPECT_GE(video.get(cv::CAP_PROP_FRAME_COUNT), 20);
}

// A spectator sees the same frames from another place. Its end does not disturb the viewer's.
TEST_F(Pipeline, ASpectatorComesAndGoes) {
  Deployed deployed(
      changed_deployment(
          out_ / "files", "  - {name: rendering, program: render_node}\n",
          "  - {name: rendering, program: render_node}\n  - {name: audience, program: "
          "render_node, viewer: {path: [{eye_m: [0.7, -0.5, 0.5], target_m: [0, 0, 0.2]}], "
          "render_size_px: [160, 120], recon_size_px: [80, 60]}}\n"),
      domain_, out_);
  ASSERT_TRUE(frames_go_on(20, kStart)) << log();
  std::map<std::string, std::uint64_t> shown;  // by process of the spectator
  const auto has_shown = [&](std::size_t processes) {
    return eventually(bus_, kStart, [&] {
      for (const auto& sample : statuses_.take())
        for (const fivepipe_v1_NamedCount& count : messages::span_of(sample->counts))
          if (sample.valid() && count.name == std::string(node::kSpectatorFrames))
            shown[bus::text_of(statuses_.process(sample))] = count.count;
      return shown.size() == processes &&
             std::ranges::all_of(shown, [](const auto& of) { return of.second >= 20; });
    });
  };
  ASSERT_TRUE(has_shown(1)) << log();
  const auto pid = deployed.pid_of("audience");
  ASSERT_TRUE(pid);
  ASSERT_EQ(kill(*pid, SIGKILL), 0);
  EXPECT_TRUE(frames_go_on(5, 1s * kSlowdown)) << log();
  EXPECT_TRUE(has_shown(2)) << log();
  deployed.signal(SIGINT);
  EXPECT_EQ(deployed.wait_for_end(10s * kSlowdown), 130) << log();
  EXPECT_EQ(cv::imread(out_ / "composite.png").size(), cv::Size(320, 240));
  const cv::Mat seen = cv::imread(out_ / "composite_audience.png");
  ASSERT_EQ(seen.size(), cv::Size(160, 120));
  const auto report = nlohmann::json::parse(std::ifstream(out_ / "report.json"));
  EXPECT_EQ(report["nodes"]["audience"]["restarts"].size(), 1u);
  auto drops = report["nodes"]["rendering"]["drops"];
  if (kHasSanitizer)  // slower than the frame rate
    for (const char* late : {"late_state", "video_frame"}) drops.erase(late);
  EXPECT_EQ(drops.size(), 0u) << report["nodes"]["rendering"];
}

TEST_F(Pipeline, ASpectatorThatCannotStartDoesNotEndTheRun) {
  // A video needs an even size.
  Deployed deployed(
      changed_deployment(out_ / "files", "  - {name: rendering, program: render_node}\n",
                         "  - {name: rendering, program: render_node}\n  - {name: audience, "
                         "program: render_node, viewer: {path: [{eye_m: [0.7, -0.5, 0.5], "
                         "target_m: [0, 0, 0.2]}], render_size_px: [161, 120]}}\n"),
      domain_, out_, {});
  // A node that is not dispensable would end the run with its fifth death.
  EXPECT_TRUE(eventually(bus_, kStart + 10s * kSlowdown, [&] {
    return contains(log(), "audience died: exit code 1 (failed), restart 5 in ");
  })) << log();
  EXPECT_TRUE(frames_go_on(20, 10s * kSlowdown)) << log();
  deployed.signal(SIGINT);  // while the spectator waits 4 s for its next start
  EXPECT_EQ(deployed.wait_for_end(10s * kSlowdown), 130) << log();
}

// Both eyes of all frames are reconstructed, drawn and shown side by side.
TEST_F(Pipeline, AStereoViewerSeesBothEyesSideBySide) {
  Deployed deployed(
      changed_deployment(out_ / "files", "viewer:\n", "viewer:\n  stereo: {eye_distance_m: 0.1}\n"),
      domain_, out_, {"--duration", "3"});
  ASSERT_TRUE(frames_go_on(20, kStart)) << log();
  ASSERT_EQ(deployed.wait_for_end(40s), 0) << log();
  const cv::Mat still = cv::imread(out_ / "composite.png");
  ASSERT_EQ(still.size(), cv::Size(640, 240));
  const cv::Mat left = still.colRange(0, 320), right = still.colRange(320, 640);
  // Each eye sees the scene, from another place.
  cv::Mat difference;
  cv::absdiff(left, right, difference);
  EXPECT_GT(cv::countNonZero(difference.reshape(1) > 20), 1000);
  EXPECT_NEAR(cv::mean(left)[1], cv::mean(right)[1], 10);
  cv::VideoCapture video((out_ / "composite.mp4").string(), cv::CAP_FFMPEG);
  ASSERT_TRUE(video.isOpened());
  EXPECT_EQ(video.get(cv::CAP_PROP_FRAME_WIDTH), 640);
  EXPECT_EQ(drops_["rendering"]["missing_eye"], 0u);
}

TEST_F(Pipeline, EmptyHullIsReportedWithTheCameraThatEmptiedIt) {
  const std::string corner_camera =
      "  - name: corner\n    image_size_px: [180, 122]\n    horizontal_fov_deg: 6\n    look_at: "
      "{eye_m: [2.0, 1.5, 1.0], target_m: [0.7, 0.55, 0.85]}\n";
  Deployed deployed(changed_deployment(out_ / "files", "name: small", "name: small", corner_camera),
                    domain_, out_, {"--duration", "2"});
  ASSERT_EQ(deployed.wait_for_end(kStart), 0) << log();
  const auto report = nlohmann::json::parse(std::ifstream(out_ / "report.json"));
  EXPECT_EQ(report["empty_cameras"], nlohmann::json({"corner"})) << report.dump(1);
}

TEST_F(Pipeline, MissingCameraIsNamedAndEndsWithThree) {
  const std::string sources = "sources: {left: {v4l2: \"57\"}, far: synthetic, right: synthetic}";
  Deployed deployed(changed_deployment(out_ / "files", "sources: synthetic", sources), domain_,
                    out_);
  EXPECT_EQ(deployed.wait_for_end(kStart), 3) << log();
  EXPECT_NE(log().find("57"), std::string::npos) << log();
  EXPECT_NE(log().find("left"), std::string::npos) << log();
}

TEST_F(Pipeline, UndecodableVideoIsNamedAndEndsWithTwo) {
  std::filesystem::create_directories(out_ / "files");
  const std::string video = out_ / "files" / "text.avi";
  std::ofstream(video) << "this is no video\n";
  const std::string sources = "sources: {left: {video: " + video + ", background: " + video +
                              "}, far: synthetic, right: synthetic}";
  Deployed deployed(changed_deployment(out_ / "files", "sources: synthetic", sources), domain_,
                    out_);
  EXPECT_EQ(deployed.wait_for_end(kStart), 2) << log();
  EXPECT_NE(log().find("text.avi"), std::string::npos) << log();
}

TEST_F(Pipeline, ConfigurationErrorsAreListedTogetherAndEndWithTwo) {
  Deployed deployed(changed_deployment(out_ / "files", "frame_rate_hz: 20",
                                       "frame_rate_hz: -20\nframe_rat: 3", "  - {name: left}\n"),
                    domain_, out_);
  EXPECT_EQ(deployed.wait_for_end(kStart), 2) << log();
  for (const char* problem : {"deployment.yaml:5:16:", "frame_rate_hz", "frame_rat", "rig.yaml"})
    EXPECT_NE(log().find(problem), std::string::npos) << problem << '\n' << log();
}

class EveryFrame : public Pipeline {
 protected:
  static constexpr std::uint64_t kFrames = 40;

  std::string deployment() const {
    write_pictures(out_ / "files", kFrames);
    return changed_deployment(out_ / "files", "sources: synthetic",
                              "max_frames_in_flight: 2, sources: " + picture_sources());
  }

  // The run ends by itself, and every frame is captured, complete and composited once.
  void expect_every_frame(Deployed& deployed) {
    std::map<std::uint64_t, int> composites;
    Clock::time_point last_composite = Clock::now();
    std::optional<int> exit_code;
    EXPECT_TRUE(eventually(bus_, kStart * kSlowdown, [&] {
      for (const auto& sample : composited_.take())
        if (sample.valid()) {
          ++composites[sample->frame];
          last_composite = Clock::now();
        }
      if (listen_also_) listen_also_();
      for (const auto& sample : sessions_.take())
        is_lossless_ = is_lossless_ || (sample.valid() && sample->lossless);
      return (exit_code = deployed.wait_for_end(0ms)).has_value();
    }));
    EXPECT_EQ(exit_code, 0) << log();
    EXPECT_TRUE(is_lossless_) << "the other nodes advance by frames";
    EXPECT_LT(Clock::now() - last_composite, 10s * kSlowdown) << "it awaits no further frame";
    EXPECT_EQ(composites.size(), kFrames);
    for (const auto& [frame, count] : composites) {
      EXPECT_LT(frame, kFrames);
      EXPECT_EQ(count, 1) << frame;
    }
    const auto report = nlohmann::json::parse(std::ifstream(out_ / "report.json"));
    for (const char* count : {"captured", "complete", "composited"})
      EXPECT_EQ(report["frames"][count], kFrames) << count << report["frames"].dump(1);
    EXPECT_EQ(report["frames"]["dropped"], nlohmann::json::object()) << report["frames"].dump(1);
  }

  bus::Reader<bus::topics::ReplaySession> sessions_ = bus_.reader<bus::topics::ReplaySession>();
  bool is_lossless_ = false;
  std::function<void()> listen_also_;
};

// Offline work: the files end the run, and no frame is skipped, however slow the nodes are. The
// simulation's time is that of the files.
TEST_F(EveryFrame, OfTheFilesIsComposited) {
  auto states = bus_.reader<bus::topics::VirtualState>();
  std::map<std::uint64_t, double> time_s;
  listen_also_ = [&] {
    for (const auto& sample : states.take())
      if (sample.valid()) time_s[sample->frame] = sample->simulation_time_s;
  };
  Deployed deployed(deployment(), domain_, out_, {"--every-frame"});
  expect_every_frame(deployed);
  EXPECT_GT(time_s.size(), kFrames / 2);  // the reader of the test may miss some
  constexpr double kRate_Hz = 20;         // of the deployment
  // The simulation advances by whole steps.
  for (const auto& [frame, s] : time_s) EXPECT_NEAR(s, double(frame) / kRate_Hz, 0.01) << frame;
}

// A frame may overtake another one, because each recon_node sends whole frames.
TEST_F(EveryFrame, OfRoundRobinReconstructionsIsComposited) {
  const std::string file = deployment();
  const std::string text = text_of(file);
  std::ofstream(file) << replaced_all(text, "recon_node,", "recon_node, split: frames,");
  Deployed deployed(file, domain_, out_, {"--every-frame"});
  expect_every_frame(deployed);
}

// recon_node is stopped as soon as its process exists, before it reads any topic.
TEST_F(EveryFrame, WaitsForANodeThatStartsLate) {
  Deployed deployed(deployment(), domain_, out_, {"--every-frame", "--no-watchdog"});
  pid_t late = 0;
  const Clock::time_point until = Clock::now() + 20s;
  while (late == 0 && Clock::now() < until)
    for (const pid_t child : deployed.all_children()) {
      std::error_code error;
      const auto program =
          std::filesystem::read_symlink("/proc/" + std::to_string(child) + "/exe", error);
      if (!error && program.filename() == "recon_node") late = child;
    }
  ASSERT_GT(late, 0) << log();
  kill(late, SIGSTOP);
  // Long enough for all other nodes: they would have lost the first frames.
  EXPECT_FALSE(eventually(bus_, 4s * kSlowdown, [&] { return !composited_.take().empty(); }));
  kill(late, SIGCONT);
  expect_every_frame(deployed);
}

// The pictures of all cameras are the same, so the maps of a frame are too if every node takes the
// same picture for it.
TEST_F(EveryFrame, OfTwoCaptureNodesIsComposited) {
  auto maps = bus_.reader<bus::topics::ObjectPixelMap>();
  const std::string node_of_far =
      "  - {name: capture_far, program: capture_node, sources: {far: {video: f%d.ppm, background: "
      "f0.ppm}}}\n";
  const std::string file = deployment();
  const std::string text =
      replaced(replaced(text_of(file), " far: {video: f%d.ppm, background: f0.ppm},", ""),
               "  - {name: recon_a", node_of_far + "  - {name: recon_a");
  std::ofstream(file) << text;
  Deployed deployed(file, domain_, out_, {"--every-frame"});
  std::map<std::uint64_t, std::map<std::string, std::vector<std::uint8_t>>> runs;  // by camera
  std::map<std::uint64_t, std::set<std::int64_t>> stamps_ns;
  listen_also_ = [&] {
    for (const auto& sample : maps.take()) {
      if (!sample.valid()) continue;
      const auto bytes = messages::span_of(sample->payload);
      runs[sample->frame][sample->camera].assign(bytes.begin(), bytes.end());
      stamps_ns[sample->frame].insert(sample->capture_stamp_ns);
    }
  };
  expect_every_frame(deployed);
  int compared = 0;
  for (const auto& [frame, by_camera] : runs) {
    if (by_camera.size() < 3) continue;  // the test's reader has missed one
    EXPECT_EQ(by_camera.at("left"), by_camera.at("far")) << frame;
    EXPECT_EQ(by_camera.at("left"), by_camera.at("right")) << frame;
    EXPECT_EQ(stamps_ns[frame].size(), 1u) << frame;
    ++compared;
  }
  EXPECT_GT(compared, int(kFrames) / 2);
}

TEST_F(Pipeline, TwoCaptureNodesCaptureTheSameFrames) {
  auto maps = bus_.reader<bus::topics::ObjectPixelMap>();
  Deployed deployed(
      changed_deployment(
          out_ / "files", "sources: synthetic, synthetic: {seed: 1, period_s: 4.0}}\n",
          "sources: {left: synthetic, right: synthetic}}\n  - {name: capture_far, program: "
          "capture_node, sources: {far: synthetic}}\n"),
      domain_, out_, {"--duration", "3"});
  std::map<std::uint64_t, std::map<std::string, std::int64_t>> stamps_ns;  // by frame and camera
  EXPECT_TRUE(eventually(bus_, kStart, [&] {
    listen();
    for (const auto& sample : maps.take())
      if (sample.valid()) stamps_ns[sample->frame][sample->camera] = sample->capture_stamp_ns;
    return frames_seen_ >= 30;
  })) << log();
  ASSERT_EQ(deployed.wait_for_end(40s), 0) << log();
  int complete = 0;
  for (const auto& [frame, by_camera] : stamps_ns) {
    if (by_camera.size() < 3) continue;
    ++complete;
    EXPECT_EQ(by_camera.at("left"), by_camera.at("far")) << frame;
  }
  EXPECT_GE(complete, 20);
  const auto report = nlohmann::json::parse(std::ifstream(out_ / "report.json"));
  EXPECT_GT(report["nodes"]["capture_far"]["counts"]["frames_captured"].get<int>(), 20);
}

// Sub-pixel silhouettes: every map has its coverage, which recon_node and sim_node receive.
TEST_F(Pipeline, CoverageAccompaniesEveryMap) {
  auto coverages = bus_.reader<bus::topics::ObjectCoverage>();
  const std::string file =
      changed_deployment(out_ / "files", "synthetic: {seed: 1, period_s: 4.0}",
                         "synthetic: {seed: 1, period_s: 4.0, supersampling: 2}");
  std::ofstream(file, std::ios::app) << "hull: {coverage: true}\n";
  Deployed deployed(file, domain_, out_, {"--duration", std::to_string(3 * kSlowdown)});
  std::map<std::string, int> covered_in_part;  // messages by camera
  EXPECT_TRUE(eventually(bus_, kStart, [&] {
    listen();
    for (const auto& sample : coverages.take())
      if (sample.valid())
        for (const std::uint8_t coverage : messages::span_of(sample->coverage))
          if (coverage > 0 && coverage < 255) {
            ++covered_in_part[sample->camera];
            break;
          }
    return frames_seen_ >= 20;
  })) << log();
  ASSERT_EQ(deployed.wait_for_end(kStart), 0) << log();
  EXPECT_EQ(covered_in_part.size(), 3u);
  for (const auto& [camera, count] : covered_in_part) EXPECT_GE(count, 10) << camera;
  const auto report = nlohmann::json::parse(std::ifstream(out_ / "report.json"));
  for (const auto& [drop, count] : report["frames"]["dropped"].items())
    if (drop.find("coverage") != std::string::npos) {
      EXPECT_LE(count, 6) << drop;  // of the first frames, before all readers are known
    }
}

TEST_F(Pipeline, WithoutARenderNodeEveryFrameIsRefused) {
  Deployed deployed(
      changed_deployment(out_ / "files", "  - {name: rendering, program: render_node}", ""),
      domain_, out_, {"--every-frame"});
  EXPECT_EQ(deployed.wait_for_end(kStart), 2) << log();
  EXPECT_NE(log().find("--every-frame needs a render_node"), std::string::npos) << log();
}

// A camera does not wait for the other nodes.
TEST_F(EveryFrame, OfACameraIsRefused) {
  const std::string sources = "sources: {left: {v4l2: \"57\"}, far: synthetic, right: synthetic}";
  Deployed deployed(changed_deployment(out_ / "files", "sources: synthetic", sources), domain_,
                    out_, {"--every-frame"});
  EXPECT_EQ(deployed.wait_for_end(kStart), 2) << log();
  EXPECT_NE(log().find("--every-frame needs files, but camera left"), std::string::npos) << log();
}

// The overlap of a mesh: sim_node finds it, and the deployment ends.
TEST_F(Pipeline, AJointedMeshWithoutClearanceIsNamedAndEndsWithTwo) {
  const std::string deployment = changed_deployment(
      out_ / "files", FIVEPIPE_SOURCE_DIR "/scenes/demo/scene.yaml", "scene.yaml");
  std::ofstream(out_ / "files" / "part.obj")
      << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  std::ofstream(out_ / "files" / "scene.yaml") << R"(name: stuck
objects:
  - name: wall
    box: {size_m: [0.5, 0.5, 0.5]}
    position_m: [0, 0, 0]
  - name: part
    mesh: {file: part.obj, unit: m}
    position_m: [0, 0, 0]
    motion: dynamic
    slider: {axis: [0, 0, 1], to_m: 1}
)";
  Deployed deployed(deployment, domain_, out_);
  EXPECT_EQ(deployed.wait_for_end(kStart), 2) << log();
  EXPECT_NE(log().find("scene.yaml:6:5: the convex hull of part overlaps wall by 0.25 m"),
            std::string::npos)
      << log();
}

// Kills each node in turn. The node restarts, and frames are composited again within kRecovery.
TEST_F(Pipeline, RecoversAfterEachNodeIsKilled) {
  Deployed deployed(kSmallDeployment, domain_, out_);
  ASSERT_TRUE(frames_go_on(20, kStart)) << log();
  for (const std::string& node : kNodes) {
    const auto old_pid = deployed.pid_of(node);
    ASSERT_TRUE(old_pid) << node;
    const auto killed_at = Clock::now();
    ASSERT_EQ(kill(*old_pid, SIGKILL), 0);
    std::optional<pid_t> new_pid;
    ASSERT_TRUE(eventually(bus_, kRecovery,
                           [&] {
                             listen();
                             new_pid = deployed.pid_of(node);
                             return new_pid && new_pid != old_pid;
                           }))
        << node << log();
    // Frames from before the death may still be composited, so only later ones count.
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(killed_at + kRecovery - Clock::now());
    ASSERT_TRUE(frames_go_on(6, std::max(left, 0ms)))
        << node << " restarted, but no frames are composited\n"
        << log();
  }
  deployed.signal(SIGTERM);
  EXPECT_EQ(deployed.wait_for_end(15s), 130) << log();
  const auto report = nlohmann::json::parse(std::ifstream(out_ / "report.json"));
  for (const std::string& node : kNodes)
    EXPECT_EQ(report["nodes"][node]["restarts"].size(), 1u)
        << node << ": " << report["nodes"][node].dump();
}

TEST_F(Pipeline, InterruptStopsAllProcessesWithinTwoSeconds) {
  Deployed deployed(kSmallDeployment, domain_, out_);
  ASSERT_TRUE(frames_go_on(5, kStart)) << log();
  const std::vector<pid_t> children = deployed.all_children();
  EXPECT_EQ(children.size(), 5u);
  deployed.signal(SIGINT);
  EXPECT_EQ(deployed.wait_for_end(2s * kSlowdown), 130) << log();
  for (const pid_t child : children) EXPECT_FALSE(is_alive(child));
}

TEST_F(Pipeline, ChildrenExitWhenSupervisorIsKilled) {
  Deployed deployed(kSmallDeployment, domain_, out_);
  ASSERT_TRUE(frames_go_on(5, kStart)) << log();
  const std::vector<pid_t> children = deployed.all_children();
  deployed.signal(SIGKILL);
  ASSERT_TRUE(deployed.wait_for_end(2s * kSlowdown));
  EXPECT_TRUE(eventually(bus_, 2s * kSlowdown,
                         [&] { return std::none_of(children.begin(), children.end(), is_alive); }));
}

TEST_F(Pipeline, SimulationIsPausedAndResumedFromTheCommandLine) {
  Deployed deployed(kSmallDeployment, domain_, out_);
  ASSERT_TRUE(frames_go_on(5, kStart)) << log();
  auto states = bus_.reader<bus::topics::VirtualState>();
  double height_m = 0;
  // Waits for `count` states. Returns whether the ball has another height in one of them.
  const auto ball_moves_within = [&](int count) {
    bool moved = false;
    const double before_m = height_m;
    EXPECT_TRUE(eventually(bus_, 10s, [&] {
      for (const auto& sample : states.take()) {
        if (!sample.valid() || sample->objects._length != 1) continue;
        height_m = sample->objects._buffer[0].world_from_object.translation_m.z;
        moved = moved || height_m != before_m;
        --count;
      }
      return count <= 0;
    }));
    return moved;
  };
  const std::string command = std::string(FIVEPIPE_BINARY_DIR) +
                              "/fivepipe simulation --deployment " + kSmallDeployment +
                              " --domain " + std::to_string(domain_) + " ";
  // After a command, the reader still has 8 states from before. The node takes commands before each
  // state.
  constexpr int kUntilCommandActs = 13;
  ball_moves_within(1);  // sets the height
  // The ball may be at rest; after a reset it falls again.
  ASSERT_EQ(std::system((command + "reset").c_str()), 0);
  EXPECT_TRUE(ball_moves_within(kUntilCommandActs));
  ASSERT_EQ(std::system((command + "reset").c_str()), 0);
  ASSERT_EQ(std::system((command + "pause").c_str()), 0);
  ball_moves_within(kUntilCommandActs);
  EXPECT_FALSE(ball_moves_within(10));
  // A reset during the pause, so that the ball falls after the resume.
  ASSERT_EQ(std::system((command + "reset").c_str()), 0);
  ball_moves_within(kUntilCommandActs);
  EXPECT_FALSE(ball_moves_within(10));
  ASSERT_EQ(std::system((command + "resume").c_str()), 0);
  EXPECT_TRUE(ball_moves_within(kUntilCommandActs + 5));
}

// The share of the image that shows the sky behind the window, which alone is blue.
double sky_share(const cv::Mat& bgr) {
  int sky = 0;
  for (int v = 0; v < bgr.rows; ++v)
    for (int u = 0; u < bgr.cols; ++u) {
      const cv::Vec3b c = bgr.at<cv::Vec3b>(v, u);
      sky += c[0] > 150 && c[0] > 1.2 * c[2];
    }
  return double(sky) / double(bgr.total());
}

// The paper's figure 4: two hands part the curtain, and the view through the window opens.
TEST_F(Pipeline, HandsPartTheCurtainBeforeTheWindow) {
  const std::string file =
      changed_deployment(out_ / "files", "scenes/demo/scene.yaml", "scenes/curtain/scene.yaml");
  std::string text = text_of(file);
  text = replaced(text, "synthetic: {", "synthetic: {actor: parting_hands, ");
  std::ofstream(file) << text;
  auto states = bus_.reader<bus::topics::VirtualState>();
  // Two periods of the hands.
  const int duration_s = 9 * kSlowdown;
  std::vector<std::string> options{"--duration", std::to_string(duration_s)};
  // By the clock, the simulation of a slow build skips the time that it cannot compute.
  if (kHasSanitizer) options.push_back("--every-frame");
  Deployed deployed(file, domain_, out_, options);
  const auto has_both_panels = [&] {
    for (const auto& sample : states.take())
      if (sample.valid()) {
        const auto objects = messages::span_of(sample->objects);
        return std::count_if(objects.begin(), objects.end(), [](const auto& object) {
                 return object.vertices_m._length == 3 * 11 * 19;
               }) == 2;
      }
    return false;
  };
  EXPECT_TRUE(eventually(bus_, kStart, has_both_panels)) << log();
  ASSERT_EQ(deployed.wait_for_end(kStart + std::chrono::seconds(duration_s)), 0) << log();
  const auto report = nlohmann::json::parse(std::ifstream(out_ / "report.json"));
  EXPECT_GT(report["nodes"]["simulation"]["counts"].value("cloth_contacts", 0), 0);
  cv::VideoCapture video((out_ / "composite.mp4").string(), cv::CAP_FFMPEG);
  double least = 1, most = 0;
  for (cv::Mat image; video.read(image);) {
    least = std::min(least, sky_share(image));
    most = std::max(most, sky_share(image));
  }
  std::printf("the sky in the window: %.1f %% of the image, then %.1f %%\n", 100 * least,
              100 * most);
  EXPECT_LT(least, 0.01);
  EXPECT_GT(most, 0.06);
}

// A hand in real images turns a virtual door about its hinge.
TEST_F(Pipeline, AHandPushesADoorOpen) {
  auto states = bus_.reader<bus::topics::VirtualState>();
  Deployed deployed(std::string(FIVEPIPE_SOURCE_DIR) + "/launch/deployments/door.yaml", domain_,
                    out_);
  double least = 1, most = -1;  // sine of half of the door's angle
  EXPECT_TRUE(eventually(
      bus_, kStart * kSlowdown,
      [&] {
        for (const auto& sample : states.take())
          for (std::uint32_t i = 0; sample.valid() && i < sample->objects._length; ++i) {
            const auto& turn = sample->objects._buffer[i].world_from_object.rotation;
            least = std::min(least, std::abs(turn.z)), most = std::max(most, std::abs(turn.z));
          }
        return least < 0.02 && most > 0.26;  // 2 and 30 degrees
      }))
      << log() << least << ' ' << most;
}

// A hand in real images catches virtual grains; render_node draws them.
TEST_F(Pipeline, ParticlesFallOnAHandAndAreDrawn) {
  auto particles = bus_.reader<bus::topics::Particles>();
  const int duration_s = 8 * kSlowdown;
  std::string file = FIVEPIPE_SOURCE_DIR "/launch/deployments/particles.yaml";
  if (kHasSanitizer) {  // the images of the deployment alone would take minutes
    std::string text = replaced(text_of(file), "frame_rate_hz: 24", "frame_rate_hz: 4");
    text = replaced(text, "../../scenes/rigs/table6.yaml",
                    FIVEPIPE_SOURCE_DIR "/tests/system/rig.yaml");
    file = out_ / "particles.yaml";
    std::filesystem::create_directories(out_);
    std::ofstream(file) << replaced_all(text, "../../scenes", FIVEPIPE_SOURCE_DIR "/scenes");
  }
  Deployed deployed(file, domain_, out_, {"--duration", std::to_string(duration_s)});
  std::map<std::string, std::uint32_t> most;
  EXPECT_TRUE(eventually(bus_, kStart * kSlowdown,
                         [&] {
                           for (const auto& sample : particles.take())
                             if (sample.valid())
                               most[sample->source] =
                                   std::max(most[sample->source], sample->p_m._length / 3);
                           return most["grains"] > 1000 && most["drops"] > 500;
                         }))
      << log() << testing::PrintToString(most);
  ASSERT_EQ(deployed.wait_for_end(kStart + std::chrono::seconds(duration_s)), 0) << log();
  const auto report = nlohmann::json::parse(std::ifstream(out_ / "report.json"));
  EXPECT_GT(report["nodes"]["simulation"]["counts"].value("particle_contacts", 0), 0);
  cv::VideoCapture video((out_ / "composite.mp4").string(), cv::CAP_FFMPEG);
  int most_gold_px = 0;
  for (cv::Mat image; video.read(image);) {
    const auto gold_px = std::count_if(
        image.begin<cv::Vec3b>(), image.end<cv::Vec3b>(),
        [](const cv::Vec3b& bgr) { return bgr[2] > 120 && bgr[1] > 80 && 2 * bgr[0] < bgr[2]; });
    most_gold_px = std::max(most_gold_px, int(gold_px));
  }
  EXPECT_GT(most_gold_px, 1000);
}

// The messages of a running pipeline have warmth, proximity, contacts, the response with the names
// of the cameras, and the hull's components, each only if the scene requests it.
TEST_F(Pipeline, CollisionResultsHoldRequestedOutputs) {
  auto states = bus_.reader<bus::topics::VirtualState>();
  auto collisions = bus_.reader<bus::topics::CollisionResult>();
  auto hull_components = bus_.reader<bus::topics::HullComponents>();
  Deployed deployed(
      changed_deployment(out_ / "files", "scenes/demo/scene.yaml", "scenes/warm_plate/scene.yaml"),
      domain_, out_);
  bool warm = false, near = false, has_details = false, moving = false;
  EXPECT_TRUE(eventually(
      bus_, kStart,
      [&] {
        for (const auto& sample : states.take())
          for (std::uint32_t i = 0; sample.valid() && i < sample->objects._length; ++i) {
            const auto warmth = messages::span_of(sample->objects._buffer[i].warmth);
            warm |= std::any_of(warmth.begin(), warmth.end(),
                                [](float w) { return w > 0.2f && w <= 1; });
          }
        for (const auto& sample : hull_components.take())
          for (std::uint32_t i = 0; sample.valid() && i < sample->components._length; ++i)
            moving |= sample->components._buffer[i].frames >= 3;
        for (const auto& sample : collisions.take()) {
          if (!sample.valid()) continue;
          const bool is_plate = std::string(sample->object) == "plate";
          EXPECT_EQ(sample->proximity._length, is_plate ? 1u : 0u);
          if (is_plate) {
            EXPECT_EQ(
                sample->contacts._length + sample->normals._length + sample->triangles._length, 0u);
            for (const float max_m : messages::span_of(sample->proximity._buffer[0].max_m))
              near |= max_m < 0.15f;
          } else if (sample->verdict == fivepipe_v1_colliding && sample->normals._length == 2) {
            EXPECT_EQ(sample->triangles._length, sample->triangles_colliding);
            EXPECT_EQ(sample->local_minimum_translation._length, 1u);
            const auto& closed_form = sample->normals._buffer[1];
            has_details |= sample->contacts._length > 0 && closed_form.cameras._length > 0 &&
                           closed_form.cameras._buffer[0].camera[0] != '\0';
          }
        }
        return warm && near && has_details && moving;
      }))
      << warm << near << has_details << moving << log();
}

// capture_node sends no such maps. The nodes drop and count them and continue.
TEST_F(Pipeline, MalformedMapsAreDroppedAndCounted) {
  Deployed deployed(kSmallDeployment, domain_, out_);
  ASSERT_TRUE(frames_go_on(5, kStart)) << log();
  bus::Bus member({.domain = domain_, .deployment = "small"});
  auto writer = member.writer<bus::topics::ObjectPixelMap>();
  ASSERT_TRUE(eventually(bus_, 10s, [&] { return writer.readers() >= 3; }));
  hull::ObjectPixels pixels(180, 122);
  pixels.set(90, 60);
  messages::OutgoingMap truncated = messages::map_message("left", 1u << 30, 1, pixels),
                        unknown = messages::map_message("nobody", 1, 1, pixels);
  truncated.payload.pop_back();
  writer.write(truncated.message());
  writer.write(unknown.message());
  EXPECT_TRUE(eventually(bus_, 10s, [&] {
    listen();
    return drops_["recon_a"].contains("bad_map: left: payload truncated or undecodable") &&
           drops_["recon_b"].contains("bad_map: nobody: unknown camera") &&
           drops_["simulation"].contains("bad_map: nobody: unknown camera");
  })) << log();
  EXPECT_TRUE(frames_go_on(10, 5s)) << log();
}

}  // namespace
}  // namespace fivepipe::test
