// Runs a real capture_node with pictures whose content is the number of their frame, and compares
// what it publishes with these pictures.
#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>

#include "common/base/realtime.h"
#include "common/base/timing.h"
#include "common/config/deployment.h"
#include "common/pipeline/messages/camera_messages.h"
#include "common/pipeline/messages/view_messages.h"
#include "common/pipeline/node/status_names.h"
#include "tests/support/process/cpu_time.h"
#include "tests/support/sanitizer.h"
#include "tests/support/scripted/peer.h"

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;
using Owners = std::vector<std::uint8_t>;
using Bgr = std::array<std::uint8_t, 3>;

constexpr int kWidth_px = 48, kHeight_px = 36, kSquare_px = 8;
constexpr std::uint8_t kGrey = 60;

// The square of a frame: its place and its colour, which is brighter than the grey room by more
// than the threshold.
struct Square {
  hull::PixelRect rect;
  Bgr bgr;
};
Square square_of(std::uint64_t frame) {
  const int u = 4 + int(frame % 8) * 4, v = 2 + int(frame / 8 % 6) * 4;
  return {{u, v, u + kSquare_px, v + kSquare_px},
          {std::uint8_t(100 + frame % 150), std::uint8_t(250 - frame % 150), 200}};
}

// `left` and `right` give shape, `above` gives only colour, `off` gives nothing.
const std::string kRig = R"(
name: pictures
volume_m: {min: [-0.4, -0.4, -0.4], max: [0.4, 0.4, 0.4]}
cameras:
  - {name: left, image_size_px: [48, 36], horizontal_fov_deg: 40,
     look_at: {eye_m: [-0.5, -1, 0.2], target_m: [0, 0, 0]}}
  - {name: right, image_size_px: [48, 36], horizontal_fov_deg: 40,
     look_at: {eye_m: [0.5, -1, 0.2], target_m: [0, 0, 0]}}
  - {name: above, image_size_px: [48, 36], horizontal_fov_deg: 60, gives_shape: false,
     look_at: {eye_m: [0, -1, 1], target_m: [0, 0, 0]}}
  - {name: "off", image_size_px: [48, 36], horizontal_fov_deg: 60, gives_shape: false,
     gives_colour: false, look_at: {eye_m: [0, -1, 1], target_m: [0, 0, 0]}}
)";
const std::string kDeployment = R"(
name: scripted
rig: rig.yaml
scene: scene.yaml
frame_rate_hz: RATE
viewer:
  name: left_eye
  path:
    - {t_s: 0, eye_m: [0, -0.8, 0], target_m: [0, 0, 0]}
    - {t_s: 1, eye_m: [0.2, -0.8, 0], target_m: [0, 0, 0]}
  recon_size_px: [24, 18]
  near_m: 0.1
  far_m: 4
nodes:
  - name: capture
    program: capture_node
)";
const std::string kTwoWorkers = R"(
  - {name: recon_a, program: recon_node, worker: 0, workers: 2, tile_columns: 2, tile_rows: 2}
  - {name: recon_b, program: recon_node, worker: 1, workers: 2, tile_columns: 2, tile_rows: 2}
)";

struct Pose {
  std::string viewer;
  std::uint64_t frame;
  std::int64_t capture_stamp_ns, source_stamp_ns;
  Eigen::Isometry3d eye_from_world;
  Owners owners;
};
Pose copied(const bus::Sample<bus::topics::HeadPose>& sample) {
  const auto owners = messages::span_of(sample->tile_owners);
  return {sample->viewer,
          sample->frame,
          sample->capture_stamp_ns,
          sample.source_stamp_ns(),
          messages::from_wire(sample->eye_from_world).value(),
          {owners.begin(), owners.end()}};
}

struct Colour {
  std::string camera;
  std::uint64_t frame;
  std::int64_t capture_stamp_ns, source_stamp_ns;
  hull::PixelRect region;
  Eigen::Isometry3d camera_from_world;
  std::vector<std::uint8_t> bgr;
};
Colour copied_colour(const bus::Sample<bus::topics::ObjectColour>& sample) {
  const auto bgr = messages::span_of(sample->bgr);
  return {sample->camera,
          sample->frame,
          sample->capture_stamp_ns,
          sample.source_stamp_ns(),
          messages::from_wire(sample->region),
          messages::from_wire(sample->camera_from_world).value(),
          {bgr.begin(), bgr.end()}};
}

struct Map {
  std::string camera;
  std::uint64_t frame;
  std::int64_t capture_stamp_ns, source_stamp_ns;
  hull::PixelRect region;
  std::uint32_t object_pixels;
};
Map copied_map(const bus::Sample<bus::topics::ObjectPixelMap>& sample) {
  return {sample->camera,
          sample->frame,
          sample->capture_stamp_ns,
          sample.source_stamp_ns(),
          messages::from_wire(sample->region),
          sample->object_pixels};
}

class CaptureNode : public ScriptedPeer {
 protected:
  Collected<bus::topics::HeadPose, Pose> poses_{bus_, copied};
  Collected<bus::topics::ObjectPixelMap, Map> maps_{bus_, copied_map};
  // Present if a node wants colour.
  std::optional<Collected<bus::topics::ObjectColour, Colour>> colours_;
  std::optional<bus::Writer<bus::topics::FrameComposited>> composited_;
  bus::Writer<bus::topics::TileCosts> costs_ = bus_.writer<bus::topics::TileCosts>();
  config::Deployment deployment_;
  std::int64_t start_ns_ = 0;

  // Writes `count` pictures per camera. `left` lacks the pictures in `gaps`.
  void write_pictures(std::uint64_t count, const std::set<std::uint64_t>& gaps = {}) const {
    const cv::Mat room(kHeight_px, kWidth_px, CV_8UC3, cv::Scalar::all(kGrey));
    for (const char* camera : {"left", "right", "above"}) {
      const std::filesystem::path folder = folder_ / camera;
      std::filesystem::create_directories(folder);
      cv::imwrite(folder / "empty.bmp", room);
      for (std::uint64_t frame = 0; frame < count; ++frame) {
        if (camera == std::string("left") && gaps.contains(frame)) continue;
        const Square square = square_of(frame);
        const cv::Scalar bgr(square.bgr[0], square.bgr[1], square.bgr[2]);
        cv::Mat image = room.clone();
        if (camera == std::string("above"))
          image.setTo(bgr);
        else
          image(cv::Rect(square.rect.u0_px, square.rect.v0_px, kSquare_px, kSquare_px)).setTo(bgr);
        cv::imwrite(folder / ("f" + std::to_string(frame) + ".bmp"), image);
      }
    }
  }
  // `options`: lines of the node's entry in the deployment.
  void start_with(int frame_rate_hz, const std::string& options, const std::string& more_nodes = "",
                  bool wants_colour = true) {
    file("rig.yaml", kRig);
    file("scene.yaml",
         "name: far\nobjects:\n  - {name: box, box: {size_m: [1, 1, 1]}, position_m: [9, 9, 9]}\n");
    std::string sources = "    sources:\n";
    for (const char* camera : {"left", "right", "above"}) sources += fmt_source(camera);
    const std::string path =
        file("deployment.yaml", replaced(kDeployment, "RATE", std::to_string(frame_rate_hz)) +
                                    sources + options + more_nodes);
    deployment_ = config::load_deployment(path);
    if (wants_colour) colours_.emplace(bus_, copied_colour);
    start_ns_ = base::now_realtime_ns();
    start("capture_node", "capture", path);
    wait_for_readers(costs_);
    if (composited_) wait_for_readers(*composited_);
  }
  static std::string fmt_source(const std::string& camera) {
    return "      " + camera + ": {video: " + camera + "/f%d.bmp, background: " + camera +
           "/empty.bmp}\n";
  }
  void take() {
    poses_.take();
    maps_.take();
    if (colours_) colours_->take();
  }
  // Waits until all messages of `count` frames that began to arrive here have arrived.
  bool has_frames(std::size_t count) {
    return holds([&] {
      take();
      return poses_.all().size() >= count && maps_.all().size() >= 2 * count &&
             (!colours_ || colours_->all().size() >= 3 * count);
    });
  }
  template <class Message>
  static std::map<std::string, Message> of_frame(const std::vector<Message>& all,
                                                 std::uint64_t frame) {
    std::map<std::string, Message> by_camera;
    for (const Message& message : all)
      if (message.frame == frame) {
        EXPECT_TRUE(by_camera.emplace(message.camera, message).second) << message.camera;
      }
    return by_camera;
  }
  void expect_picture(const Map& map, std::uint64_t picture) const {
    EXPECT_EQ(map.region, square_of(picture).rect) << map.camera << " " << map.frame;
    EXPECT_EQ(map.object_pixels, unsigned(kSquare_px * kSquare_px));
  }
  void expect_picture(const Colour& colour, std::uint64_t picture) const {
    const Square square = square_of(picture);
    if (colour.camera != "above") {
      EXPECT_EQ(colour.region, square.rect);
      EXPECT_EQ(colour.bgr.size(), unsigned(3 * kSquare_px * kSquare_px));
    }
    EXPECT_FALSE(colour.bgr.empty());
    for (std::size_t i = 0; i < colour.bgr.size(); ++i)
      ASSERT_EQ(colour.bgr[i], square.bgr[i % 3]) << colour.camera << " " << colour.frame;
  }
  // Reports that the frame is composited.
  void send_composited(std::uint64_t frame, std::int64_t composited_stamp_ns = 0,
                       const char* viewer = "left_eye") {
    fivepipe_v1_FrameComposited message{};
    messages::set_text(message.viewer, viewer);
    message.frame = frame;
    message.composited_stamp_ns = composited_stamp_ns;
    composited_->write(message);
  }
  // The costs of two of the four tiles, those of the worker in a round-robin assignment.
  void send_costs(std::uint64_t frame, int worker, std::array<float, 2> cost_ms,
                  const char* viewer = "left_eye") {
    std::vector<std::uint16_t> tiles =
        worker == 0 ? std::vector<std::uint16_t>{0, 3} : std::vector<std::uint16_t>{1, 2};
    std::vector<float> costs(cost_ms.begin(), cost_ms.end());
    fivepipe_v1_TileCosts message{};
    messages::set_text(message.viewer, viewer);
    message.worker = std::uint16_t(worker);
    message.frame = frame;
    messages::borrow(message.tiles, tiles);
    messages::borrow(message.cost_ms, costs);
    deliver(costs_, message);
  }
  std::uint64_t newest_frame() {
    take();
    return poses_.all().back().frame;
  }
};

TEST_F(CaptureNode, PublishesPoseColoursAndMapsOfTheSameFrame) {
  constexpr std::uint64_t kPictures = 400;  // then the node begins again
  write_pictures(kPictures);
  start_with(40, "");
  // A late reader receives these.
  auto infos = bus_.reader<bus::topics::CameraInfo>();
  auto views = bus_.reader<bus::topics::ViewInfo>();
  std::map<std::string, std::string> mismatches;
  std::vector<messages::ViewGeometry> geometries;
  ASSERT_TRUE(holds([&] {
    for (const auto& sample : infos.take())
      mismatches[sample->camera] = messages::model_mismatch(*sample, deployment_.rig);
    for (const auto& sample : views.take()) {
      EXPECT_STREQ(sample->viewer, "left_eye");
      EXPECT_EQ(messages::from_wire(sample->render), config::render_pinhole(deployment_.viewer));
      geometries.push_back(std::get<messages::ViewGeometry>(
          messages::view_geometry_from(*sample, deployment_.viewer)));
    }
    return mismatches.size() >= 3 && !geometries.empty();
  }));
  EXPECT_EQ(mismatches,
            (std::map<std::string, std::string>{{"left", ""}, {"right", ""}, {"above", ""}}));
  EXPECT_EQ(geometries[0].recon, config::recon_pinhole(deployment_.viewer));
  EXPECT_EQ(geometries[0].near_m, 0.1);
  EXPECT_EQ(geometries[0].far_m, 4);

  ASSERT_TRUE(has_frames(8)) << said();
  const NodeReport report = ended();
  take();
  int compared = 0;
  for (const Pose& pose : poses_.all()) {
    const auto colours = of_frame(colours_->all(), pose.frame);
    const auto maps = of_frame(maps_.all(), pose.frame);
    if (colours.size() < 3 || maps.size() < 2) continue;  // before this test's readers
    ++compared;
    SCOPED_TRACE(pose.frame);
    EXPECT_EQ(pose.viewer, "left_eye");
    EXPECT_TRUE(pose.owners.empty()) << "there is no recon_node";
    EXPECT_TRUE(pose.eye_from_world.isApprox(
        config::eye_from_world_at(deployment_.viewer, double(pose.frame) / 40), 1e-12));
    std::int64_t earliest_ns = INT64_MAX;
    for (const auto& [camera, colour] : colours) {
      expect_picture(colour, pose.frame % kPictures);
      EXPECT_GT(colour.source_stamp_ns, pose.source_stamp_ns);
      EXPECT_GE(colour.capture_stamp_ns, start_ns_);
      EXPECT_LE(colour.capture_stamp_ns, pose.source_stamp_ns);
      earliest_ns = std::min(earliest_ns, colour.capture_stamp_ns);
      for (const config::RigCamera& in_rig : deployment_.rig.cameras)
        if (in_rig.name == camera) {
          EXPECT_TRUE(colour.camera_from_world.isApprox(in_rig.camera_from_mount, 1e-12));
        }
    }
    EXPECT_EQ(pose.capture_stamp_ns, earliest_ns);
    for (const auto& [camera, map] : maps) {
      expect_picture(map, pose.frame % kPictures);
      EXPECT_EQ(map.capture_stamp_ns, colours.at(camera).capture_stamp_ns);
      for (const auto& [other, colour] : colours)
        EXPECT_GT(map.source_stamp_ns, colour.source_stamp_ns);
    }
  }
  EXPECT_GE(compared, 8);
  EXPECT_TRUE(std::is_sorted(poses_.all().begin(), poses_.all().end(),
                             [](const Pose& a, const Pose& b) { return a.frame < b.frame; }));
  const std::uint64_t frames = report.counts.at(node::kFramesCaptured);
  EXPECT_GE(frames, poses_.all().size());
  EXPECT_EQ(report.sent.at(bus::topics::HeadPose::name), frames);
  EXPECT_EQ(report.frame, poses_.all().back().frame);
  EXPECT_EQ(report.latencies.at("read").count, 3 * frames);
  EXPECT_GT(report.latencies.at("read").p50_ms, 0);
  EXPECT_EQ(report.latencies.at("segment").count, 3 * frames);
  EXPECT_GT(report.latencies.at("segment").p50_ms, 0);
  EXPECT_GT(report.counts.at(node::kSegmentationCpu), 0u);
  EXPECT_GT(report.counts.at(node::kPublishingCpu), 0u);
  EXPECT_GT(report.counts.at(node::kFramesCpu),
            report.counts.at(node::kSegmentationCpu) + report.counts.at(node::kPublishingCpu));
  EXPECT_EQ(report.latencies.at("capture").count, frames);
  EXPECT_EQ(report.latencies.at("publish").count, frames);
  EXPECT_EQ(report.latencies.at(node::kCaptureToPublished).count, frames);
  EXPECT_TRUE(report.diagnostics.empty()) << report.diagnostics.begin()->second;
  EXPECT_EQ(drops_of(report, "missing_image"), 0u);
}

TEST_F(CaptureNode, ReportsTheTimesOfEachFrame) {
  write_pictures(400);
  start_with(40, "");
  // The node has handled this many frames before it found the reader of the traces.
  const auto untraced = [&] {
    const auto traced = std::count_if(traces().begin(), traces().end(), [&](const auto& trace) {
      return trace.frame <= report().frame;
    });
    const auto found = report().latencies.find(node::kCaptureToPublished);
    return found == report().latencies.end() ? 1000 : std::ptrdiff_t(found->second.count) - traced;
  };
  ASSERT_TRUE(holds([&] {
    take();
    return std::ptrdiff_t(traces().size()) >= 3 * untraced() + 10;
  })) << said();
  const NodeReport report = ended();
  take();
  std::vector<double> shortest_ms, longest_ms;  // possible latencies of the traced frames
  for (const TracedFrame& trace : traces()) {
    EXPECT_EQ(trace.node, "capture");
    ASSERT_EQ(trace.steps.size(), 2u);
    EXPECT_EQ(trace.steps[0].name, "capture");
    EXPECT_EQ(trace.steps[1].name, "publish");
    EXPECT_EQ(trace.first_input_ns, 0);
    // The image arrives within the step `capture`, and the pose leaves within `publish`.
    std::vector<std::int64_t> times{trace.steps[0].start_ns, trace.capture_stamp_ns,
                                    trace.steps[0].end_ns, trace.steps[1].start_ns};
    if (const auto pose = std::find_if(poses_.all().begin(), poses_.all().end(),
                                       [&](const Pose& one) { return one.frame == trace.frame; });
        pose != poses_.all().end()) {
      EXPECT_EQ(trace.capture_stamp_ns, pose->capture_stamp_ns);
      times.push_back(pose->source_stamp_ns);
    }
    times.push_back(trace.steps[1].end_ns);
    EXPECT_TRUE(std::is_sorted(times.begin(), times.end())) << testing::PrintToString(times);
    shortest_ms.push_back(1e-6 * double(trace.steps[1].start_ns - trace.capture_stamp_ns));
    longest_ms.push_back(1e-6 * double(trace.steps[1].end_ns - trace.capture_stamp_ns));
  }
  // The median of all frames is between the quartiles of three quarters of them.
  std::sort(shortest_ms.begin(), shortest_ms.end());
  std::sort(longest_ms.begin(), longest_ms.end());
  const auto& latency = report.latencies.at(node::kCaptureToPublished);
  EXPECT_GE(latency.p50_ms, shortest_ms[shortest_ms.size() / 4] - 1e-3);
  EXPECT_LE(latency.p50_ms, longest_ms[longest_ms.size() * 3 / 4] + 1e-3);
}

TEST_F(CaptureNode, NeedsNeitherARenderNodeNorAReaderOfColour) {
  write_pictures(400);
  start_with(40, "", "", false);
  ASSERT_TRUE(has_frames(15)) << said();
  // Without a render_node the clock alone decides. A node that waited for composites would take
  // three frames every half second.
  int waits = 0;
  for (std::size_t i = 1; i < poses_.all().size(); ++i)
    waits += poses_.all()[i].capture_stamp_ns - poses_.all()[i - 1].capture_stamp_ns > 400'000'000;
  EXPECT_LE(waits, 1);
  // The node wakes up for each frame, so it does not skip every second one.
  int consecutive = 0;
  for (std::size_t i = 1; i < poses_.all().size(); ++i)
    consecutive += poses_.all()[i].frame == poses_.all()[i - 1].frame + 1;
  EXPECT_GT(consecutive, 0);
  // The camera that is not read has no stamp.
  for (const Pose& pose : poses_.all())
    if (const auto maps = of_frame(maps_.all(), pose.frame); maps.size() == 2) {
      EXPECT_EQ(pose.capture_stamp_ns,
                std::min(maps.at("left").capture_stamp_ns, maps.at("right").capture_stamp_ns));
    }
  const NodeReport report = ended();
  EXPECT_EQ(report.sent.at(bus::topics::ObjectColour::name), 0u);
  EXPECT_EQ(report.sent.at(bus::topics::ObjectPixelMap::name),
            2 * report.counts.at(node::kFramesCaptured));
}

// At 1 kHz each frame is due at once. The test reports a frame only after the next one arrived, so
// two are in flight, and the node may take the one after that only when it knows of the report.
TEST_F(CaptureNode, KeepsAtMostTheConfiguredFramesInFlight) {
  write_pictures(20);
  composited_.emplace(bus_.writer<bus::topics::FrameComposited>());
  start_with(1000, "    max_frames_in_flight: 2\n    precomputed_frames: 20\n", "", false);
  std::vector<std::int64_t> reported_ns;  // by index of the frame in poses_
  ASSERT_TRUE(holds([&] {
    take();
    while (reported_ns.size() + 1 < poses_.all().size()) {
      reported_ns.push_back(base::now_realtime_ns());
      send_composited(poses_.all()[reported_ns.size() - 1].frame);
    }
    return poses_.all().size() > 60;
  })) << said();
  const NodeReport report = ended();
  take();
  const std::vector<Pose>& poses = poses_.all();
  int early = 0;
  for (std::size_t i = 2; i < reported_ns.size() + 1; ++i) {
    // After 500 ms without a composite the node continues. A frame before the matching of the
    // test's writer is not held back either.
    const bool stalled = poses[i].capture_stamp_ns - poses[i - 2].capture_stamp_ns > 400'000'000;
    early += !stalled && i > 10 && poses[i].capture_stamp_ns < reported_ns[i - 2];
  }
  EXPECT_EQ(early, 0);
  EXPECT_EQ(drops_of(report, "pipeline_busy") + report.counts.at(node::kFramesCaptured),
            poses.back().frame + 1);
}

TEST_F(CaptureNode, RefusesCompositesWithAnImpossibleStamp) {
  write_pictures(20);
  composited_.emplace(bus_.writer<bus::topics::FrameComposited>());
  start_with(1000, "    max_frames_in_flight: 2\n    precomputed_frames: 20\n", "", false);
  ASSERT_TRUE(has_frames(2)) << said();
  send_composited(poses_.all().front().frame, -1);
  EXPECT_TRUE(holds([&] { return drops_of(report(), "bad_composited") == 1; })) << said();
}

// Composites of another viewer do not count either.
TEST_F(CaptureNode, GoesOnWithoutCompositesAfterHalfASecond) {
  write_pictures(20);
  composited_.emplace(bus_.writer<bus::topics::FrameComposited>());
  start_with(1000, "    max_frames_in_flight: 2\n    precomputed_frames: 20\n", "", false);
  // Two frames, half a second, two frames. The node does not wait before it has discovered this
  // test's writer.
  std::size_t seen = 0;
  int waits = 0;
  const auto has_waited = [&](int times) {
    take();
    const std::vector<Pose>& poses = poses_.all();
    for (; seen < poses.size(); ++seen) {
      if (seen > 0)
        waits += poses[seen].capture_stamp_ns - poses[seen - 1].capture_stamp_ns >= 490'000'000;
      send_composited(poses[seen].frame, 0, "right_eye");
    }
    return waits >= times;
  };
  ASSERT_TRUE(holds([&] { return has_waited(1); })) << said();
  const auto start = std::chrono::steady_clock::now();
  const double cpu_before_s = cpu_s(program_->pid());
  ASSERT_TRUE(holds([&] { return has_waited(3); })) << said();
  // The node sleeps while no frame may start.
  EXPECT_LT(cpu_s(program_->pid()) - cpu_before_s, kMaxWaitingShare * base::seconds_since(start));
  // Progress is reported by tens.
  for (const auto& [text, is_reported] :
       {std::pair{", 10 %", true}, {", 15 %", false}, {", 20 %", true}, {", 100 %", true}})
    EXPECT_EQ(said().find(std::string("precomputing frames") + text) != std::string::npos,
              is_reported)
        << text << '\n'
        << said();
  const std::string once = "precomputing frames, 10 %";
  EXPECT_EQ(said().find(once), said().rfind(once)) << said();
  // The frames that became due meanwhile are counted.
  const NodeReport report = ended();
  take();
  EXPECT_GT(report.drops.at("pipeline_busy"), 900u);
  EXPECT_EQ(report.drops.at("pipeline_busy") + report.counts.at(node::kFramesCaptured),
            poses_.all().back().frame + 1);
}

TEST_F(CaptureNode, AssignsTheTilesByTheCostsOfItsFrames) {
  write_pictures(20);
  // The node considers the costs of the newest 64 frames, which last 2.1 s at 30 Hz.
  start_with(30, "    precomputed_frames: 20\n    max_frames_in_flight: 0\n", kTwoWorkers, false);
  const Owners round_robin{0, 1, 1, 0};
  const auto owners_after = [&](std::size_t count) {
    const std::size_t before = (take(), poses_.all().size());
    EXPECT_TRUE(holds([&] {
      take();
      return poses_.all().size() >= before + count;
    })) << said();
    return poses_.all().back().owners;
  };
  const auto send = [&](std::uint64_t first, const char* viewer = "left_eye") {
    for (std::uint64_t frame = first; frame < first + 4; ++frame) {
      send_costs(frame, 0, {10, 1}, viewer);
      send_costs(frame, 1, {1, 1}, viewer);
    }
  };
  ASSERT_TRUE(holds([&] {
    take();
    return !poses_.all().empty() && poses_.all().back().frame > 80;
  })) << said();
  EXPECT_EQ(poses_.all().back().owners, round_robin);
  // Costs of another viewer, of frames that this process has not published, and of old ones.
  send(newest_frame() - 8, "right_eye");
  send(newest_frame() + 100'000);
  send(newest_frame() - 80);
  // Invalid ones, which the node counts when it has taken all of these.
  send_costs(newest_frame() - 1, 0, {NAN, 1});
  send_costs(newest_frame() - 1, 2, {1, 1});
  ASSERT_TRUE(holds([&] {
    take();
    return report().drops.contains("bad_tile_costs") && report().drops.at("bad_tile_costs") == 2;
  })) << said();
  EXPECT_EQ(owners_after(3), round_robin);
  // One tile takes ten times as long as each of the others.
  ASSERT_TRUE(holds([&] {
    send(newest_frame() - 30);
    take();
    return poses_.all().back().owners != round_robin;
  })) << said();
  EXPECT_EQ(poses_.all().back().owners, (Owners{0, 1, 1, 1}));
  EXPECT_EQ(owners_after(3), (Owners{0, 1, 1, 1}));
  EXPECT_EQ(ended().drops.at("bad_tile_costs"), 2u);
}

// Plays two reconstruction nodes, which answer each frame, and a render_node.
class CaptureNodeWithWorkers : public CaptureNode {
 protected:
  void SetUp() override {
    write_pictures(20);
    composited_.emplace(bus_.writer<bus::topics::FrameComposited>());
    start_with(10, "    precomputed_frames: 20\n    max_frames_in_flight: 1\n", kTwoWorkers, false);
    workers_.emplace(0, bus_.writer<bus::topics::TileCosts>());
    workers_.emplace(1, bus_.writer<bus::topics::TileCosts>());
    for (auto& [worker, costs] : workers_) wait_for_readers(costs);
  }
  // Answers the frames that have arrived, as these workers. A frame is composited if all owners of
  // its tiles have answered.
  void answer(const std::set<int>& workers) {
    take();
    for (; answered_ < poses_.all().size(); ++answered_) {
      const Pose& pose = poses_.all()[answered_];
      std::size_t tiles_made = 0;
      for (const int worker : workers) {
        std::vector<std::uint16_t> tiles;
        for (std::size_t tile = 0; tile < pose.owners.size(); ++tile)
          if (pose.owners[tile] == worker) tiles.push_back(std::uint16_t(tile));
        std::vector<float> costs(tiles.size(), 1.0f);
        tiles_made += tiles.size();
        fivepipe_v1_TileCosts message{};
        messages::set_text(message.viewer, "left_eye");
        message.worker = std::uint16_t(worker);
        message.frame = pose.frame;
        messages::borrow(message.tiles, tiles);
        messages::borrow(message.cost_ms, costs);
        workers_.at(worker).write(message);
      }
      if (tiles_made == pose.owners.size()) send_composited(pose.frame);
    }
  }
  // Whether `count` frames in a row have these owners, while these workers answer.
  bool have_owners(const std::set<std::uint8_t>& owners, const std::set<int>& workers,
                   int count = 5) {
    int in_a_row = 0;
    std::size_t seen = poses_.all().size();
    return holds([&] {
      answer(workers);
      for (; seen < poses_.all().size(); ++seen) {
        const Owners& of_frame = poses_.all()[seen].owners;
        in_a_row =
            std::set<std::uint8_t>(of_frame.begin(), of_frame.end()) == owners ? in_a_row + 1 : 0;
      }
      return in_a_row >= count;
    });
  }
  // The longest time between two frames from frame `first` on.
  double longest_gap_s(std::size_t first) {
    std::int64_t longest_ns = 0;
    const std::vector<Pose>& all = poses_.all();
    for (std::size_t i = first + 1; i < all.size(); ++i)
      longest_ns = std::max(longest_ns, all[i].source_stamp_ns - all[i - 1].source_stamp_ns);
    return 1e-9 * double(longest_ns);
  }

  std::map<int, bus::Writer<bus::topics::TileCosts>> workers_;
  std::size_t answered_ = 0;
};

TEST_F(CaptureNodeWithWorkers, GivesTheTilesOfASilentOneToTheOther) {
  ASSERT_TRUE(have_owners({0, 1}, {0, 1}, 20)) << said();
  const std::size_t before = poses_.all().size() - 1;
  ASSERT_TRUE(have_owners({0}, {0})) << said();
  // The frames in flight, which wait for the silent one, hold up the next ones no longer than that
  // takes.
  EXPECT_LT(longest_gap_s(before), kHasSanitizer ? 2 : 0.25);
  EXPECT_NE(said().find("recon_b: gives no answer"), std::string::npos) << said();
  EXPECT_TRUE(holds([&] { return report().diagnostics.contains("recon_b"); })) << said();
  // It comes back.
  EXPECT_TRUE(have_owners({0, 1}, {0, 1})) << said();
  EXPECT_TRUE(holds([&] {
    answer({0, 1});
    return !report().diagnostics.contains("recon_b");
  })) << said();
}

TEST_F(CaptureNodeWithWorkers, GivesTheTilesOfOneThatEndsToTheOtherAtOnce) {
  ASSERT_TRUE(have_owners({0, 1}, {0, 1}, 20)) << said();
  answer({0, 1});
  const std::uint64_t newest = newest_frame();
  workers_.erase(1);
  ASSERT_TRUE(have_owners({0}, {0}, 1)) << said();
  EXPECT_LE(newest_frame(), newest + (kHasSanitizer ? 8 : 2));
  EXPECT_TRUE(have_owners({0}, {0}, 8)) << said();
  // Not by its silence, which is found about as fast at this frame rate.
  EXPECT_NE(said().find("recon_b: has ended or is out of reach; it gets no tiles"),
            std::string::npos)
      << said();
  EXPECT_EQ(said().find("recon_b: gives no answer"), std::string::npos) << said();
}

// The node counts costs that are not finite if it considers them at all, so the count shows which
// ages it considers. A frame is in flight for half a second, during which it stays the newest.
TEST_F(CaptureNode, ConsidersCostsOfTheNewest64Frames) {
  write_pictures(20);
  composited_.emplace(bus_.writer<bus::topics::FrameComposited>());
  start_with(1000, "    max_frames_in_flight: 1\n    precomputed_frames: 20\n", kTwoWorkers, false);
  const auto counted = [&] { return drops_of(report(), "bad_tile_costs"); };
  ASSERT_TRUE(holds([&] {
    take();
    return !poses_.all().empty() && poses_.all().back().frame > 200;
  })) << said();
  // Sends costs of this age right after a new frame, until the node has counted one more.
  std::uint64_t sent = 0;
  const auto send_until_counted = [&](std::uint64_t age_frames) {
    ASSERT_TRUE(reports_again(2)) << said();  // which count all costs that were sent before
    const std::uint64_t before = counted();
    std::uint64_t last = newest_frame();
    ASSERT_TRUE(holds([&] {
      if (const std::uint64_t newest = newest_frame(); newest != last) {
        last = newest;
        send_costs(newest - age_frames, 0, {NAN, 1});
        ++sent;
      }
      return counted() > before;
    })) << said();
  };
  send_until_counted(0);
  for (int i = 0; i < 40; ++i) send_costs(newest_frame() - 64, 0, {NAN, 1});
  send_until_counted(63);
  EXPECT_LE(counted(), sent);
  EXPECT_LE(ended().drops.at("bad_tile_costs"), sent);
}

TEST_F(CaptureNode, NamesMissingImagesAndEmptyMaps) {
  // `left` lacks two pictures, and the last one shows only the room.
  write_pictures(400, {3, 4});
  cv::imwrite(folder_ / "right" / "f2.bmp",
              cv::Mat(kHeight_px, kWidth_px, CV_8UC3, cv::Scalar::all(kGrey)));
  start_with(40, "    precomputed_frames: 5\n    max_frames_in_flight: 0\n");
  ASSERT_TRUE(holds([&] {
    take();
    return poses_.all().size() >= 12;
  })) << said();
  const NodeReport report = ended();
  take();
  std::set<std::uint64_t> shown;
  for (const Pose& pose : poses_.all()) {
    const std::uint64_t picture = pose.frame % 5;
    const auto maps = of_frame(maps_.all(), pose.frame);
    const auto colours = of_frame(colours_->all(), pose.frame);
    // The reader of the maps may have displaced one of the oldest frame.
    if (!maps.contains("right")) continue;
    shown.insert(picture);
    EXPECT_EQ(maps.contains("left"), picture < 3) << pose.frame;
    for (const auto& [camera, map] : maps)
      if (picture != 2 || camera != "right") expect_picture(map, picture);
    if (picture == 2) {
      EXPECT_EQ(maps.at("right").object_pixels, 0u);
      EXPECT_TRUE(colours.empty()) << "the hull is empty";
    }
    for (const auto& [camera, colour] : colours) expect_picture(colour, picture);
  }
  EXPECT_EQ(shown.size(), 5u);
  // Each frame with a missing picture counts once, unless the node was late and skipped it.
  const std::uint64_t frames = poses_.all().back().frame + 1,
                      with_missing = frames / 5 * 2 + (frames % 5 > 3 ? frames % 5 - 3 : 0),
                      skipped = drops_of(report, "pipeline_busy"),
                      missing = report.drops.at("missing_image: left");
  EXPECT_LE(missing, with_missing);
  EXPECT_GE(missing + skipped, with_missing);
  EXPECT_EQ(report.drops.count("missing_image: right"), 0u);
  // The log has the texts of all frames, the status those of the last one.
  EXPECT_NE(said().find("camera left: " + (folder_ / "left" / "f%d.bmp").string() +
                        ": frame 3 is missing or cannot be decoded"),
            std::string::npos)
      << said();
  EXPECT_NE(said().find("camera right: no object pixels: the hull is empty"), std::string::npos);
  EXPECT_EQ(report.diagnostics.contains("camera left"), poses_.all().back().frame % 5 >= 3);
  EXPECT_EQ(report.diagnostics.contains("camera right"), poses_.all().back().frame % 5 == 2);
  // The progress of the start, which the status does not keep.
  for (const char* text : {"start: camera ", ": source and background, 30 %",
                           ": source and background, 60 %", ": source and background, 100 %",
                           "start: precomputing frames, 20 %", "start: precomputing frames, 100 %"})
    EXPECT_NE(said().find(text), std::string::npos) << text << '\n' << said();
  EXPECT_FALSE(report.diagnostics.contains("start"));
}

TEST_F(CaptureNode, EndsAfterTheLastPictureWithoutLoop) {
  // Longer than both sides take to find each other.
  write_pictures(200);
  start_with(40, "    loop: false\n    max_frames_in_flight: 0\n", "", false);
  EXPECT_EQ(wait_for_end(), 0) << said();
  ASSERT_TRUE(holds([&] { return report().is_final; }));
  EXPECT_LT(report().frame, 200u) << "the last picture";
  EXPECT_GT(report().frame, 150u);
  take();
  EXPECT_FALSE(maps_.all().empty());
  for (const Map& map : maps_.all()) expect_picture(map, map.frame);
}

}  // namespace
}  // namespace fivepipe::test
