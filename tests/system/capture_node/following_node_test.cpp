// Runs a real capture_node that follows the first one of its deployment, in whose place the test
// sends poses.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <thread>

#include "common/base/realtime.h"
#include "common/config/deployment.h"
#include "common/pipeline/messages/camera_messages.h"
#include "common/pipeline/messages/view_messages.h"
#include "tests/support/scripted/peer.h"

namespace fivepipe::test {
namespace {

constexpr int kWidth_px = 48, kHeight_px = 36, kSquare_px = 8;
constexpr std::uint64_t kPictures = 10;

const std::string kRig = R"(
name: pictures
volume_m: {min: [-0.4, -0.4, -0.4], max: [0.4, 0.4, 0.4]}
cameras:
  - {name: left, image_size_px: [48, 36], horizontal_fov_deg: 40,
     look_at: {eye_m: [-0.5, -1, 0.2], target_m: [0, 0, 0]}}
  - {name: right, image_size_px: [48, 36], horizontal_fov_deg: 40,
     look_at: {eye_m: [0.5, -1, 0.2], target_m: [0, 0, 0]}}
)";
const std::string kDeployment = R"(
name: scripted
rig: rig.yaml
scene: scene.yaml
frame_rate_hz: 100
viewer:
  path: [{t_s: 0, eye_m: [0, -0.8, 0], target_m: [0, 0, 0]}]
nodes:
  - {name: first, program: capture_node, sources: {left: {video: f%d.bmp, background: empty.bmp}}}
  - {name: second, program: capture_node, sources: {right: {video: f%d.bmp, background: empty.bmp}}}
  - {name: rendering, program: render_node}
)";

// Place of the square in a picture.
hull::PixelRect square_of(std::uint64_t picture) {
  const int u = 2 + 4 * int(picture);
  return {u, 10, u + kSquare_px, 10 + kSquare_px};
}

struct Map {
  std::string camera;
  std::uint64_t frame;
  std::int64_t capture_stamp_ns;
  hull::PixelRect region;
};
Map copied(const bus::Sample<bus::topics::ObjectPixelMap>& sample) {
  return {sample->camera, sample->frame, sample->capture_stamp_ns,
          messages::from_wire(sample->region)};
}

class FollowingNode : public ScriptedPeer {
 protected:
  explicit FollowingNode(const std::vector<std::string>& options = {}) {
    const cv::Mat room(kHeight_px, kWidth_px, CV_8UC3, cv::Scalar::all(60));
    cv::imwrite(folder_ / "empty.bmp", room);
    for (std::uint64_t picture = 0; picture < kPictures; ++picture) {
      cv::Mat image = room.clone();
      image(cv::Rect(square_of(picture).u0_px, 10, kSquare_px, kSquare_px))
          .setTo(cv::Scalar(0, 250, 200));
      cv::imwrite(folder_ / ("f" + std::to_string(picture) + ".bmp"), image);
    }
    file("rig.yaml", kRig);
    file("scene.yaml",
         "name: far\nobjects:\n  - {name: box, box: {size_m: [1, 1, 1]}, position_m: [9, 9, 9]}\n");
    const std::string path = file("deployment.yaml", kDeployment);
    deployment_ = config::load_deployment(path);
    start("capture_node", "second", path, options);
    wait_for_readers(*poses_);
  }
  // The node then finds the poses together.
  void send_while_stopped(const std::vector<std::uint64_t>& frames) {
    program_->signal(SIGSTOP);
    for (const std::uint64_t frame : frames) poses_->write(pose_of(frame).message());
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    program_->signal(SIGCONT);
  }
  messages::OutgoingPose pose_of(std::uint64_t frame) const {
    return messages::head_pose_message(
        deployment_.viewer,
        {frame, stamp_of(frame), config::eye_from_world_at(deployment_.viewer, 0), {}});
  }
  static std::int64_t stamp_of(std::uint64_t frame) { return 1'000'000'000 + std::int64_t(frame); }
  void send_pose(std::uint64_t frame) { deliver(*poses_, pose_of(frame).message()); }
  // Waits until the map of this frame has arrived; checks all maps.
  bool has_map(std::uint64_t frame) {
    const bool arrived = holds([&] {
      maps_.take();
      return !maps_.all().empty() && maps_.all().back().frame == frame;
    });
    for (const Map& map : maps_.all()) {
      EXPECT_EQ(map.camera, "right");
      EXPECT_EQ(map.region, square_of(map.frame % kPictures)) << map.frame;
      EXPECT_EQ(map.capture_stamp_ns, stamp_of(map.frame)) << "the time of the first node";
    }
    return arrived;
  }

  config::Deployment deployment_;
  Collected<bus::topics::ObjectPixelMap, Map> maps_{bus_, copied};
  std::optional<bus::Writer<bus::topics::HeadPose>> poses_{bus_.writer<bus::topics::HeadPose>()};
};

TEST_F(FollowingNode, CapturesTheFrameOfEachPose) {
  for (const std::uint64_t frame : {0, 1, 2, 5}) {
    send_pose(frame);
    EXPECT_TRUE(has_map(frame)) << frame << said();
  }
  EXPECT_EQ(maps_.all().size(), 4u);
  const NodeReport report = ended();
  EXPECT_EQ(report.counts.at("frames_captured"), 4u);
  EXPECT_EQ(report.drops.size(), 0u);
}

// The node is stopped while the first one goes on.
TEST_F(FollowingNode, CapturesTheNewestFrameIfItIsSlow) {
  send_pose(0);
  EXPECT_TRUE(has_map(0));
  send_while_stopped({1, 2, 3, 4});
  EXPECT_TRUE(has_map(4));
  const NodeReport report = ended();
  // The node may have found the first poses before the others.
  EXPECT_GE(drops_of(report, "pipeline_busy"), 1u);
  EXPECT_EQ(drops_of(report, "pipeline_busy") + report.counts.at("frames_captured"), 5u);
}

// The file begins again at the same frame as that of the first node, whichever frames this node has
// captured.
TEST_F(FollowingNode, ShowsThePictureOfTheFrameAfterTheEndOfItsFile) {
  for (const std::uint64_t frame : {1, 13, 14, 27}) {
    send_pose(frame);
    EXPECT_TRUE(has_map(frame)) << frame << said();
  }
}

// The node also reads what the render_node has composited.
TEST_F(FollowingNode, SleepsBetweenFrames) {
  auto composited = bus_.writer<bus::topics::FrameComposited>();
  wait_for_readers(composited);
  send_pose(0);
  EXPECT_TRUE(has_map(0));
  fivepipe_v1_FrameComposited message{};
  messages::set_text(message.viewer, deployment_.viewer.name);
  message.capture_stamp_ns = message.composited_stamp_ns = base::now_realtime_ns();
  deliver(composited, message);
  expect_sleep();
}

TEST_F(FollowingNode, RefusesCompositesWithAnImpossibleStamp) {
  auto composited = bus_.writer<bus::topics::FrameComposited>();
  wait_for_readers(composited);
  fivepipe_v1_FrameComposited message{};
  messages::set_text(message.viewer, deployment_.viewer.name);
  message.composited_stamp_ns = -1;
  deliver(composited, message);
  EXPECT_TRUE(holds([&] { return drops_of(report(), "bad_composited") == 1; })) << said();
}

struct FollowingNodeWithoutClock : FollowingNode {
  FollowingNodeWithoutClock() : FollowingNode({"--every-frame"}) {}
};

TEST_F(FollowingNodeWithoutClock, CapturesEveryFrame) {
  send_pose(0);
  EXPECT_TRUE(has_map(0));
  send_while_stopped({1, 2, 3, 4});
  EXPECT_TRUE(has_map(4));
  EXPECT_EQ(maps_.all().size(), 5u);
  const NodeReport report = ended();
  EXPECT_EQ(report.counts.at("frames_captured"), 5u);
  EXPECT_EQ(report.drops.size(), 0u);
}

// Its frames begin again at 0.
TEST_F(FollowingNode, FollowsARestartedFirstNode) {
  for (const std::uint64_t frame : {6, 7}) {
    send_pose(frame);
    EXPECT_TRUE(has_map(frame));
  }
  auto late = std::move(*poses_);
  poses_.emplace(bus_.writer<bus::topics::HeadPose>());
  wait_for_readers(*poses_);
  for (const std::uint64_t frame : {0, 1}) {
    send_pose(frame);
    EXPECT_TRUE(has_map(frame)) << said();
  }
  std::swap(late, *poses_);
  send_pose(8);
  std::swap(late, *poses_);
  send_pose(2);
  EXPECT_TRUE(has_map(2));
  EXPECT_EQ(maps_.all().size(), 5u) << "no map of frame 8";
  EXPECT_EQ(drops_of(ended(), "other_writer"), 1u);
}

TEST_F(FollowingNode, NamesTheNodeThatSendsNoPoses) {
  EXPECT_TRUE(holds([&] { return report().diagnostics.contains("poses"); })) << said();
  EXPECT_EQ(report().diagnostics.at("poses"),
            "no HeadPose for 5 s from first, the first capture_node, which decides when frames are "
            "captured");
  send_pose(0);
  EXPECT_TRUE(has_map(0));
  EXPECT_TRUE(holds([&] { return !report().diagnostics.contains("poses"); }));
}

}  // namespace
}  // namespace fivepipe::test
