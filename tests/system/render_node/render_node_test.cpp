// What render_node shows and reports of crafted messages.
#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "common/base/realtime.h"
#include "common/config/views.h"
#include "common/pipeline/node/status_names.h"
#include "tests/support/not_finite.h"
#include "tests/support/optional_package.h"
#include "tests/support/sanitizer.h"
#include "tests/support/virtual_display.h"
#include "tests/system/render_node/render_node_fixture.h"

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;

TEST_F(RenderNode, HighlightsTheCollidingObjectsOfTheFrameOfTheImage) {
  start_with(", video: false, still_frame: 7");
  using Verdicts = std::map<std::string, fivepipe_v1_CollisionVerdict>;
  const std::map<std::uint64_t, Verdicts> script{
      {5, {{"touched", fivepipe_v1_free}, {"free", fivepipe_v1_colliding}}},
      {6, {{"touched", fivepipe_v1_free}, {"free", fivepipe_v1_colliding}}},
      {7,
       {{"touched", fivepipe_v1_colliding},
        {"free", fivepipe_v1_free},
        {"undecided", fivepipe_v1_undecided},
        {"scenery", fivepipe_v1_colliding}}},
      {8, {{"free", fivepipe_v1_colliding}, {"undecided", fivepipe_v1_colliding}}}};
  // The results of the next frame arrive before this frame is composited.
  for (const auto& [frame, verdicts] : script) {
    for (const auto& [object, verdict] : verdicts) send_collision(frame, object.c_str(), verdict);
    send_collision(frame, "met", fivepipe_v1_free, frame == 7);
    send_state(frame);
    if (frame > 5) send_hull(frame - 1);
    ASSERT_TRUE(has_composited(frame - 5)) << said();
  }
  send_hull(8);
  ASSERT_TRUE(has_composited(4)) << said();
  EXPECT_EQ(red_boxes(still()), (std::set<std::string>{"touched", "met"}));
}

TEST_F(RenderNode, ShowsTheParticlesOfTheFrameOfTheImage) {
  start_with(", video: false, still_frame: 7");
  for (const std::uint64_t frame : {6, 7, 8}) {
    send_particle(frame, 0.1 * (double(frame) - 7));
    send_state(frame);
    if (frame > 6) send_hull(frame - 1);
    ASSERT_TRUE(has_composited(frame - 6)) << said();
  }
  send_particle(8, 0, "smoke");
  send_particle(8, kNaN);
  send_hull(8);
  ASSERT_TRUE(has_composited(3)) << said();
  const cv::Mat image = still();
  EXPECT_TRUE(is_blue_at(image, 0));
  EXPECT_FALSE(is_blue_at(image, -0.1) || is_blue_at(image, 0.1));
  EXPECT_TRUE(holds([&] {
    return drops_of(report(), "bad_particles: smoke") == 1 &&
           drops_of(report(), "bad_particles: grains") == 1;
  })) << said();
}

TEST_F(RenderNode, ShowsTheOverlaysOfTheFrameOfTheImage) {
  start_with(", video: false, still_frame: 7", true, "viewer", "overlays: [collision_points]\n");
  for (const std::uint64_t frame : {6, 7, 8}) {
    send_point(frame, "touched", {0.1 * (double(frame) - 7), 0, 0});
    send_point(frame, "scenery", {0, 0, -0.1});
    if (frame == 7) {
      send_point(frame, "met", {0.2, 0, -0.1});
      send_point(frame, "free", {0.2, kNaN, 0});
    }
    send_state(frame);
    if (frame > 6) send_hull(frame - 1);
    ASSERT_TRUE(has_composited(frame - 6)) << said();
  }
  send_hull(8);
  ASSERT_TRUE(has_composited(3)) << said();
  const cv::Mat image = still();
  const auto is_white = [&](double x_m, double z_m) {
    return at(image, x_m, z_m) == cv::Vec3b(255, 255, 255);
  };
  EXPECT_TRUE(is_white(0, 0));
  EXPECT_TRUE(is_white(0.2, -0.1));
  EXPECT_FALSE(is_white(-0.1, 0) || is_white(0.1, 0)) << "of another frame";
  EXPECT_FALSE(is_white(0, -0.1)) << "of an object without reaction";
  EXPECT_EQ(red_boxes(image), (std::set<std::string>{"touched", "met"})) << "free is invalid";
  EXPECT_TRUE(holds([&] { return drops_of(report(), "bad_collision: free") == 1; })) << said();
}

TEST_F(RenderNode, WithoutOverlaysInTheSceneItIgnoresThem) {
  start_with(", video: false, still_frame: 7");
  send_point(7, "touched", {0, 0, 0});
  send_point(7, "free", {0, kNaN, 0});
  send_state(7);
  send_hull(7);
  ASSERT_TRUE(has_composited(1)) << said();
  EXPECT_EQ(at(still(), 0, 0), at(still(), 0.1, 0));
  EXPECT_EQ(ended().drops, (std::map<std::string, std::uint64_t>{}));
}

// The ball is red where it is closest to the hull: everywhere.
TEST_F(RenderNode, TheOverlaysFollowTheObjectsOfTheImage) {
  scene_ = replaced(kScene, "reaction: none, colour_rgb: [0.1, 0.9, 0.1]",
                    "report: {proximity: {}}, colour_rgb: [0.1, 0.9, 0.1]");
  start_with(", video: false, still_frame: 7", true, "viewer", "overlays: [proximity]\n");
  const config::SceneObject& ball = deployment_.scene.objects.back();
  std::vector<float> min_m(config::mesh_of(ball).vertices_m.size(), 0), max_m = min_m;
  std::vector<fivepipe_v1_ProximityField> fields(1);
  fields[0].of = fivepipe_v1_of_vertices;
  fields[0].cap_m = 0.05;
  messages::borrow(fields[0].min_m, min_m);
  messages::borrow(fields[0].max_m, max_m);
  fivepipe_v1_CollisionResult message{};
  messages::set_text(message.object, "ball");
  message.frame = 7;
  message.capture_stamp_ns = stamp_of(7);
  messages::borrow(message.proximity, fields);
  deliver(collisions_, message);
  send_state(7, 0.3);
  send_hull(7);
  ASSERT_TRUE(has_composited(1)) << said();
  const cv::Vec3b bgr = at(still(), 0.3, -0.2);
  EXPECT_GT(bgr[2], 150) << bgr;
  EXPECT_LT(bgr[1], 60) << bgr;
}

const std::string kShadows =
    "shadows: {target_m: [0, 0, 0], fov_deg: 60, hull_size_px: [40, 40]}\n";

// The hull in the light's view hides the light from all objects.
TEST_F(RenderNode, TheHullInTheLightsViewOfTheSameFrameCastsItsShadow) {
  std::map<bool, int> brightness;
  for (const bool is_shadowed : {false, true}) {
    std::filesystem::remove(out_ / "composite.png");
    start_with(", video: false, still_frame: 2", true, "viewer", kShadows);
    for (const std::uint64_t frame : {1, 2, 3}) {
      send_state(frame);
      for (const int half : {0, 1})
        deliver(tiles_, light_tile(frame, half, is_shadowed == (frame == 2) ? 0.3f : 0).wire());
      send_hull(frame);
    }
    ASSERT_TRUE(has_composited(3 * (is_shadowed ? 2 : 1))) << said();
    const cv::Vec3b box = at(still(), 0.2, 0.2);
    brightness[is_shadowed] = box[0] + box[1] + box[2];
    EXPECT_EQ(drops_of(ended(), "late_light_view"), 0u);
  }
  EXPECT_LT(brightness[true], 0.7 * brightness[false]);
}

TEST_F(RenderNode, WaitsForTheLightsViewAndCountsALateOne) {
  start_with(", video: false", true, "viewer", kShadows);
  begin_replay(true);
  send_state(1);
  send_hull(1);
  send_state(2);
  EXPECT_TRUE(reports_again());
  EXPECT_TRUE(composited_.take().empty()) << "it waits for the light's view";
  for (const int half : {0, 1}) deliver(tiles_, light_tile(1, half, 0).wire());
  ASSERT_TRUE(has_composited(1)) << said();
  end_replay();
  send_hull(2);
  ASSERT_TRUE(has_composited(2)) << said();
  EXPECT_EQ(drops_of(ended(), "late_light_view"), 1u);
}

// The keys of a viewer whose eyes are 20 cm to the left and to the right of the head.
const std::string kStereo = "viewer\n  stereo: {eye_distance_m: 0.4}";

TEST_F(RenderNode, ShowsBothEyesSideBySide) {
  start_with(", video: false, still_frame: 1", true, kStereo);
  send_state(1);
  for (const std::size_t eye : {0, 1}) {
    // The hull fills the view's upper right in blue for the left eye, in yellow for the right one.
    Tile right_half = tile(1, 1, eye);
    right_half.message.covered = {24, 0, 32, 4};
    right_half.depth_m.assign(32, 0.5f);
    for (int i = 0; i < 32; ++i)
      right_half.bgr.insert(right_half.bgr.end(),
                            {std::uint8_t(eye == 0 ? 250 : 20), std::uint8_t(eye == 0 ? 20 : 240),
                             std::uint8_t(eye == 0 ? 30 : 250)});
    deliver(tiles_, tile(1, 0, eye).wire());
    deliver(tiles_, right_half.wire());
  }
  ASSERT_TRUE(has_composited(1)) << said();
  const cv::Mat image = still(), left = image.colRange(0, 64), right = image.colRange(64, 128);
  EXPECT_EQ(left.at<cv::Vec3b>(3, 58), cv::Vec3b(250, 20, 30));
  EXPECT_EQ(right.at<cv::Vec3b>(3, 58), cv::Vec3b(20, 240, 250));
  // The ball is in the middle before the head: to the right of the left eye.
  EXPECT_TRUE(has_ball_at(left, 0.2));
  EXPECT_TRUE(has_ball_at(right, -0.2));
  EXPECT_FALSE(has_ball_at(left, -0.2) || has_ball_at(right, 0.2));
}

TEST_F(RenderNode, WaitsForBothEyesAndCountsAMissingOne) {
  start_with(", video: false", true, kStereo);
  for (const std::uint64_t frame : {1, 2, 3}) send_state(frame);
  send_hull(1, 0);
  wait_until_taken();
  EXPECT_TRUE(composited_.take().empty()) << "without the right eye";
  send_hull(1, 1);
  ASSERT_TRUE(has_composited(1)) << said();
  send_hull(2, 1);
  for (const std::size_t eye : {1, 0}) send_hull(3, eye);
  ASSERT_TRUE(has_composited(2)) << said();
  EXPECT_EQ(composited_frames(), (std::vector<std::uint64_t>{1, 3}));
  EXPECT_STREQ(composited_.all()[0].viewer, "viewer") << "capture_node paces itself by this name";
  // The node's trace begins with the first tile of the first eye.
  ASSERT_TRUE(holds([&] { return traces().size() == 2; }));
  EXPECT_LT(traces()[0].first_input_ns, traces()[0].last_input_ns);
  // bad_tile: wait_until_taken().
  EXPECT_EQ(ended().drops,
            (std::map<std::string, std::uint64_t>{
                {"bad_tile: pose is not finite or not a rotation", 1}, {"missing_eye", 1}}));
}

// As in the replay of a recording of a viewer with another number of eyes.
TEST_F(RenderNode, NamesTilesOfAViewerWithAnotherNumberOfEyes) {
  for (const bool is_stereo : {true, false}) {
    start_with(", video: false", true, is_stereo ? kStereo : "viewer");
    Tile other = tile(1, 0);
    messages::set_text(other.message.viewer, is_stereo ? "viewer" : "viewer/right");
    deliver(tiles_, other.wire());
    const std::string text = "bad_tile: " + std::string(other.message.viewer) +
                             ": stereo differs from this node's deployment";
    EXPECT_TRUE(holds([&] { return drops_of(report(), text) == 1; })) << said();
    ended();
  }
}

TEST_F(RenderNode, ShowsTheHullOfTheTilesInFrontOfAndBehindTheObjects) {
  start_with(", video: false");
  send_state(0);
  Tile left = tile(0, 0), right = tile(0, 1);
  // Columns 4 to 11, rows 2 to 9 of the view: in front of the boxes `touched` and `free`.
  left.message.covered = {4, 2, 12, 10};
  left.depth_m.assign(64, 0.5f);
  for (int i = 0; i < 64; ++i) left.bgr.insert(left.bgr.end(), {250, 20, 30});
  // Behind the box `met`: 1.5 m away.
  right.message.covered = {17, 2, 25, 10};
  right.depth_m.assign(64, 1.5f);
  for (int i = 0; i < 64; ++i) right.bgr.insert(right.bgr.end(), {20, 240, 250});
  deliver(tiles_, left.wire());
  deliver(tiles_, right.wire());
  ASSERT_TRUE(has_composited(1)) << said();
  const cv::Mat image = still();
  EXPECT_EQ(at(image, -0.2, 0.2), cv::Vec3b(250, 20, 30));
  EXPECT_EQ(at(image, 0.1, 0.2), cv::Vec3b(20, 240, 250));  // beside the box
  const cv::Vec3b box = at(image, 0.2, 0.2);
  EXPECT_NEAR(box[0], box[2], 20) << box;
}

TEST_F(RenderNode, DropsOfEachKindAreCountedOnce) {
  start_with(", video: false");
  Tile other_view = tile(1, 0);
  messages::set_text(other_view.message.viewer, "somebody");
  deliver(tiles_, other_view.wire());  // belongs to another render_node: no drop
  Tile not_a_rotation = tile(1, 0), outside = tile(1, 0), bad_number = tile(1, 0);
  not_a_rotation.message.eye_from_world.rotation.w = 2;
  outside.message.rect.u1_px = 40;
  bad_number.message.tile = 2;
  deliver(tiles_, not_a_rotation.wire());
  for (int i = 0; i < 3; ++i) deliver(tiles_, outside.wire());
  for (int i = 0; i < 2; ++i) deliver(tiles_, bad_number.wire());
  fivepipe_v1_CollisionResult too_early{};
  messages::set_text(too_early.object, "touched");
  too_early.capture_stamp_ns = -1;
  deliver(collisions_, too_early);
  send_state(1, 0, "ball", 7);         // not a rotation
  send_state(2, 0, "unknown");         // not in the scene; composited with frame 2
  deliver(tiles_, tile(1, 0).wire());  // frame 1 stays incomplete
  send_hull(2);
  ASSERT_TRUE(has_composited(1)) << said();
  deliver(tiles_, tile(1, 1).wire());  // late
  deliver(tiles_, tile(2, 1).wire());  // repeated
  deliver(tiles_, tile(2, 0).wire());  // repeated
  send_state(3);
  send_hull(3);
  ASSERT_TRUE(has_composited(2)) << said();
  const auto sum = [&] {
    std::uint64_t all = 0;
    for (const auto& [text, count] : this->report().drops) all += count;
    return all;
  };
  EXPECT_TRUE(holds([&] { return sum() == 13; })) << said();
  const NodeReport report = ended();
  EXPECT_EQ(report.drops, (std::map<std::string, std::uint64_t>{
                              {"bad_tile: pose is not finite or not a rotation", 1},
                              {"bad_tile: rect outside the view", 3},
                              {"bad_tile: bad tile number", 2},
                              {"bad_collision: touched: timestamp before 1970 or after 2200", 1},
                              {"bad_state: ball: pose is not finite or not a rotation", 1},
                              {"bad_state: unknown: not in the scene", 1},
                              {"incomplete_hull", 1},
                              {"late_tile", 1},
                              {"repeated_tile", 2}}));
  EXPECT_EQ(report.counts.at(node::kFramesComposited), 2u);
}

// Without Mesa's cache of shaders, as on a machine that starts fivepipe for the first time. The
// frame needs the shaders of objects, the coloured hull, shadows, particles, discs and arrows.
TEST_F(RenderNode, DrawsItsFirstFrameAsFastAsTheNext) {
  // llvmpipe compiles all of them in 0.4 s, those of the shadow in 20 ms, each other group in 40 ms
  // or more.
  constexpr double kMaxCompilation_ms = 12 * kSlowdown;
  scene_ = replaced(kScene, "position_m: [-0.4, 0, 0.2]",
                    "position_m: [-0.4, 0, 0.2], report: {response: {}}");
  setenv("MESA_SHADER_CACHE_DISABLE", "true", 1);
  start_with(", video: false, still_frame: 7", true, "viewer",
             kShadows + "overlays: [collision_points, recovery]\n");
  unsetenv("MESA_SHADER_CACHE_DISABLE");
  for (const std::uint64_t frame : {1, 2}) {
    send_particle(frame, 0);
    send_point(frame, "touched", {-0.3, 0, 0}, fivepipe_v1_Vec3{-0.2, 0, 0});
    send_state(frame);
    for (const int half : {0, 1}) {
      deliver(tiles_, light_tile(frame, half, 0.3f).wire());
      Tile hull = tile(frame, half);
      hull.message.covered = hull.message.rect;
      hull.depth_m.assign(16 * 24, 1.5f);
      hull.bgr.assign(3 * hull.depth_m.size(), 100);
      deliver(tiles_, hull.wire());
    }
    ASSERT_TRUE(has_composited(frame)) << said();
  }
  ASSERT_TRUE(holds([&] { return traces().size() == 2; })) << said();
  const auto drawn_ms = [&](std::size_t index) {
    const TracedFrame::Step& step = traces()[index].steps.at(0);
    return 1e-6 * double(step.end_ns - step.start_ns);
  };
  std::cout << "first frame " << drawn_ms(0) << " ms, second " << drawn_ms(1) << " ms\n";
  EXPECT_LE(drawn_ms(0), drawn_ms(1) + kMaxCompilation_ms);
}

TEST_F(RenderNode, ReportsEachCompositedFrame) {
  start_with(", video: false", true, "left_eye");
  const std::int64_t sent_ns = base::now_realtime_ns();
  for (const std::uint64_t frame : {4, 7}) {
    send_state(frame);
    send_hull(frame);
    ASSERT_TRUE(has_composited(frame == 4 ? 1 : 2)) << said();
  }
  const std::int64_t end_ns = base::now_realtime_ns();
  ASSERT_TRUE(holds([&] { return traces().size() == 2; })) << said();
  for (int i = 0; i < 2; ++i) {
    const Composited& composited = composited_.all()[std::size_t(i)];
    const TracedFrame& trace = traces()[std::size_t(i)];
    const std::uint64_t frame = i == 0 ? 4 : 7;
    EXPECT_STREQ(composited.viewer, "left_eye");
    EXPECT_EQ(composited.frame, frame);
    EXPECT_EQ(composited.capture_stamp_ns, stamp_of(frame));
    EXPECT_EQ(trace.node, "rendering");
    EXPECT_EQ(trace.frame, frame);
    EXPECT_EQ(trace.capture_stamp_ns, stamp_of(frame));
    ASSERT_EQ(trace.steps.size(), 1u);
    EXPECT_EQ(trace.steps[0].name, "render");
    const std::vector<std::int64_t> times{sent_ns,
                                          trace.first_input_ns,
                                          trace.last_input_ns,
                                          trace.steps[0].start_ns,
                                          trace.steps[0].end_ns,
                                          composited.composited_stamp_ns,
                                          end_ns};
    EXPECT_TRUE(std::is_sorted(times.begin(), times.end())) << testing::PrintToString(times);
  }
  NodeReport report = ended();
  EXPECT_EQ(report.counts.at(node::kFramesComposited), 2u);
  EXPECT_EQ(report.frame, 7u);
  EXPECT_FALSE(report.gl_renderer.empty());
  EXPECT_EQ(report.latencies.at("render").count, 2u);
  const auto& latency = report.latencies.at(node::kCaptureToComposite);
  EXPECT_EQ(latency.count, 2u);
  double max_ms = -1e9;
  for (const Composited& one : composited_.all())
    max_ms = std::max(max_ms, 1e-6 * double(one.composited_stamp_ns - one.capture_stamp_ns));
  EXPECT_NEAR(latency.max_ms, max_ms, 0.01);  // float
  EXPECT_FALSE(report.latencies.contains(node::kArrivalToComposite));
}

TEST_F(RenderNode, NamesTheCamerasThatEmptyTheHullWhileTheyDo) {
  start_with(", video: false");
  for (const std::uint64_t frame : {1, 2}) {
    Tile left = tile(frame, 0), right = tile(frame, 1);
    if (frame == 1) {
      left.empty_cameras.push_back({'c', 'a', 'm'});
      right.empty_cameras.push_back({'c', 'a', 'm'});
    }
    send_state(frame);
    deliver(tiles_, left.wire());
    deliver(tiles_, right.wire());
    // The node counts a frame before it sets the diagnostic.
    std::map<std::string, std::string> expected;
    if (frame == 1) expected["hull"] = "empty: no object pixel in camera cam";
    ASSERT_TRUE(holds([&] {
      const NodeReport& now = report();
      const auto count = now.counts.find(node::kFramesComposited);
      return count != now.counts.end() && count->second == frame && now.diagnostics == expected;
    })) << said();
  }
}

// The deployment has a sim_node, which was killed, for example.
TEST_F(RenderNode, ThePictureSaysThatTheSimulationIsMissing) {
  const std::string simulation = "}\n  - {name: simulation, program: sim_node";
  start_with(", video: false, still_frame: 40" + simulation);
  send_state(1);
  send_hull(1);
  ASSERT_TRUE(has_composited(1)) << said();
  // Capture stamps are one period apart.
  for (const std::uint64_t frame : {10, 40}) {
    send_hull(frame);
    ASSERT_TRUE(has_composited(frame == 10 ? 2 : 3)) << said();
    EXPECT_TRUE(holds([&] { return report().diagnostics.contains("simulation") == (frame == 40); }))
        << said();
  }
  const cv::Mat image = still();
  EXPECT_LT(cv::mean(image.row(47))[1], 0.5 * cv::mean(image.row(40))[1]) << "a dark bar";
  send_state(41);
  send_hull(41);
  EXPECT_TRUE(holds([&] { return !report().diagnostics.contains("simulation"); })) << said();
}

// The gap of 0.9 s at 1000 Hz is filled with 899 images, more than the encoder's queue holds.
TEST_F(RenderNode, CountsTheFramesThatTheVideoLacks) {
  frame_rate_hz_ = 1000;
  start_with("", false);
  for (const std::uint64_t frame : {0, 900, 901}) {
    send_hull(frame);
    ASSERT_TRUE(has_composited(frame == 0 ? 1 : frame - 898)) << said();
  }
  const std::uint64_t dropped = drops_of(ended(), "video_frame");
  EXPECT_GT(dropped, 0u);
  cv::VideoCapture video((out_ / "composite.mp4").string(), cv::CAP_FFMPEG);
  std::uint64_t frames = 0;
  while (video.grab()) ++frames;
  EXPECT_EQ(frames + dropped, 902u);
}

// The video is also playable while the node writes it.
TEST_F(RenderNode, LeavesAPlayableVideoWhenItIsKilled) {
  start_with("", false);
  const auto frames_in_video = [&] {
    cv::VideoCapture video((out_ / "composite.mp4").string(), cv::CAP_FFMPEG);
    int frames = 0;
    while (video.grab()) ++frames;
    return frames;
  };
  std::size_t composited = 0;
  EXPECT_TRUE(holds([&] {
    send_hull(20 * composited);  // the video repeats the image before it 20 times
    return has_composited(++composited) && frames_in_video() >= 60;
  })) << said();
  program_->signal(SIGKILL);
  EXPECT_EQ(wait_for_end(), 128 + SIGKILL);
  EXPECT_GE(frames_in_video(), 60);
}

TEST_F(RenderNode, EndsWhenTheUserClosesItsWindow) {
  const VirtualDisplay display;
  if (display.display().empty()) FIVEPIPE_SKIP_WITHOUT_PACKAGE("Xvfb is not installed");
  start_with(", video: false, window: true", false);
  for (const std::uint64_t frame : {1, 2}) {
    send_hull(frame);
    ASSERT_TRUE(has_composited(frame)) << said();
  }
  Keyboard keyboard;
  keyboard.send(Keyboard::kPress, 0x71);  // XK_q
  // The window closes at any time after the key; the next frame ends the node.
  std::uint64_t frame = 3;
  EXPECT_TRUE(holds([&] {
    tiles_.write(tile(frame, 0).wire());
    tiles_.write(tile(frame++, 1).wire());
    return !is_alive(program_->pid());
  })) << said();
  EXPECT_EQ(wait_for_end(), 0);
}

// DDS reports the end of a writer as a sample without data.
TEST_F(RenderNode, TheEndOfAWriterIsNoMessage) {
  start_with(", video: false", false);
  {
    auto tiles = bus_.writer<bus::topics::HullTile>();
    wait_for_readers(tiles);
    deliver(tiles, tile(1, 0).wire());
  }
  EXPECT_TRUE(reports_again(2));
  deliver(tiles_, tile(1, 1).wire());
  ASSERT_TRUE(has_composited(1)) << said();
  EXPECT_EQ(ended().drops, (std::map<std::string, std::uint64_t>{}));
}

// Only the still needs the image, so the node reads back the last one when it ends.
TEST_F(RenderNode, WritesTheLastFrameIfTheStillFrameNeverComes) {
  start_with(", video: false, still_frame: 1000");
  for (const std::uint64_t frame : {1, 2}) {
    send_state(frame, 0.3 * double(frame) - 0.3);
    send_hull(frame);
  }
  ASSERT_TRUE(has_composited(2)) << said();
  EXPECT_FALSE(std::filesystem::exists(out_ / "composite.png"));
  ended();
  EXPECT_TRUE(has_ball_at(still(), 0.3));
}

// It draws its own view, which differs from the viewer's, and no node waits for its composites.
TEST_F(RenderNode, DrawsForASpectator) {
  start_with(
      ", video: false, viewer: {path: [{eye_m: [0.8, -1, 0], target_m: [0, 0, 0]}], "
      "horizontal_fov_deg: 60, render_size_px: [96, 48], recon_size_px: [32, 24]}",
      false);
  const config::Viewer& viewer = *config::spectator_of(deployment_.nodes.front());
  const auto spectators_half = [&](std::uint64_t frame, int half) {
    Tile tile = this->tile(frame, half);
    messages::set_text(tile.message.viewer, "rendering");
    tile.message.eye_from_world = messages::to_wire(config::eye_from_world_at(viewer, 0));
    tile.message.recon = messages::to_wire(config::recon_pinhole(viewer));
    return tile;
  };
  send_hull(1);  // for the viewer
  for (const std::uint64_t frame : {2, 3})
    for (const int half : {0, 1}) deliver(tiles_, spectators_half(frame, half).wire());
  ASSERT_TRUE(holds([&] {
    return report().counts.contains(node::kSpectatorFrames) &&
           report().counts.at(node::kSpectatorFrames) == 2;
  })) << said();
  EXPECT_EQ(composited_.writers(), 0);
  const NodeReport report = ended();
  EXPECT_TRUE(report.drops.empty());
  EXPECT_FALSE(report.counts.contains(node::kFramesComposited));
  EXPECT_EQ(report.latencies.at(node::kCaptureToSpectator).count, 2u);
  EXPECT_FALSE(report.latencies.contains(node::kCaptureToComposite));
  EXPECT_EQ(cv::imread((out_ / "composite_rendering.png").string()).size(), cv::Size(96, 48));
  EXPECT_FALSE(std::filesystem::exists(out_ / "composite.png"));
}

}  // namespace
}  // namespace fivepipe::test
