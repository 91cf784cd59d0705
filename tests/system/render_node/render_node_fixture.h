// Drives a real render_node by crafted messages: the fixture of its tests.
#pragma once
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/base/realtime.h"
#include "common/config/deployment.h"
#include "common/config/views.h"
#include "tests/support/scripted/peer.h"

namespace fivepipe::test {

using Composited = fivepipe_v1_FrameComposited;

inline constexpr double kFrameRate_hz = 30;
inline constexpr double kNear_m = 0.05, kFar_m = 5;

// Five boxes of 12 cm in a row, 20 cm above the axis of the view and 1 m away, and a ball below it
// that only the simulation moves.
inline const std::string kScene = R"(
name: row
light_m: [0, -1, 1]
objects:
  - {name: touched, box: {size_m: [0.12, 0.12, 0.12]}, position_m: [-0.4, 0, 0.2]}
  - {name: free, box: {size_m: [0.12, 0.12, 0.12]}, position_m: [-0.2, 0, 0.2]}
  - {name: undecided, box: {size_m: [0.12, 0.12, 0.12]}, position_m: [0, 0, 0.2]}
  - {name: met, box: {size_m: [0.12, 0.12, 0.12]}, position_m: [0.2, 0, 0.2]}
  - {name: scenery, box: {size_m: [0.12, 0.12, 0.12]}, position_m: [0.4, 0, 0.2], reaction: none}
  - {name: ball, sphere: {radius_m: 0.06}, position_m: [0, 0, -0.2], motion: dynamic,
     reaction: none, colour_rgb: [0.1, 0.9, 0.1]}
particles:
  - {name: grains, from_m: [0, 0, 1], to_m: [0, 0, 1], rate_hz: 1, lifetime_s: 1, radius_m: 0.016,
     colour_rgb: [0.05, 0.1, 0.95]}
)";
inline const std::string kRig = R"(
name: one
volume_m: {min: [-0.5, -0.5, -0.5], max: [0.5, 0.5, 0.5]}
cameras:
  - {name: cam, image_size_px: [16, 12], horizontal_fov_deg: 60,
     look_at: {eye_m: [0, -2, 0], target_m: [0, 0, 0]}}
)";
inline const std::string kDeployment = R"(
name: scripted
rig: rig.yaml
scene: scene.yaml
frame_rate_hz: 30
viewer:
  path: [{t_s: 0, eye_m: [0, -1, 0], target_m: [0, 0, 0]}]
  horizontal_fov_deg: 60
  render_size_px: [64, 48]
  recon_size_px: [32, 24]
nodes:
  - {name: rendering, program: render_node)";

class RenderNode : public ScriptedPeer {
 protected:
  bus::Writer<bus::topics::HullTile> tiles_ = bus_.writer<bus::topics::HullTile>();
  bus::Writer<bus::topics::CollisionResult> collisions_ =
      bus_.writer<bus::topics::CollisionResult>();
  bus::Writer<bus::topics::Particles> particles_ = bus_.writer<bus::topics::Particles>();
  // Present if a simulation takes part.
  std::optional<bus::Writer<bus::topics::VirtualState>> states_;
  Collected<bus::topics::FrameComposited, Composited> composited_{
      bus_, [](const bus::Sample<bus::topics::FrameComposited>& sample) { return *sample; }};
  const std::int64_t start_ns_ = base::now_realtime_ns();
  config::Deployment deployment_;
  int frame_rate_hz_ = 30;
  std::string scene_ = kScene;

  // Starts the node with these options of its entry in the deployment. `with_simulation`: whether
  // the test writes VirtualState.
  void start_with(const std::string& options, bool with_simulation = true,
                  const std::string& viewer = "viewer", const std::string& light = "") {
    file("rig.yaml", kRig);
    file("scene.yaml", replaced(scene_, "light_m: [0, -1, 1]\n", "light_m: [0, -1, 1]\n" + light));
    const std::string path =
        file("deployment.yaml",
             replaced(replaced(kDeployment, "viewer:\n", "viewer:\n  name: " + viewer + "\n"),
                      "frame_rate_hz: 30", "frame_rate_hz: " + std::to_string(frame_rate_hz_)) +
                 options + "}\n");
    deployment_ = config::load_deployment(path);
    if (with_simulation) states_.emplace(bus_.writer<bus::topics::VirtualState>());
    start("render_node", "rendering", path);
    wait_for_readers(tiles_, collisions_, particles_);
    if (states_) wait_for_readers(*states_);
    ASSERT_TRUE(holds([&] {
      return composited_.writers() > 0 || config::spectator_of(deployment_.nodes.front());
    }));
  }
  std::int64_t stamp_of(std::uint64_t frame) const {
    return start_ns_ + std::int64_t(1e9 / kFrameRate_hz * double(frame));
  }

  // One of two tiles: the left or the right half of the view.
  struct Tile {
    fivepipe_v1_HullTile message{};
    std::vector<float> depth_m;
    std::vector<std::uint8_t> bgr;
    std::vector<std::array<char, 33>> empty_cameras;
    const fivepipe_v1_HullTile& wire() {
      messages::borrow(message.depth_m, depth_m);
      messages::borrow(message.bgr, bgr);
      message.empty_cameras._buffer = reinterpret_cast<char(*)[33]>(empty_cameras.data());
      message.empty_cameras._length = message.empty_cameras._maximum =
          std::uint32_t(empty_cameras.size());
      return message;
    }
  };
  // Of the viewer's only eye, or of one of two: views without a light.
  Tile tile(std::uint64_t frame, int half, std::size_t eye = 0) const {
    const config::Viewer& viewer = deployment_.viewer;
    Tile tile;
    const std::vector<config::HullView> views = config::hull_views(deployment_);
    const config::HullView& view =
        views[views.size() - config::eye_positions_m(viewer).size() + eye];
    messages::set_text(tile.message.viewer, view.name);
    tile.message.tile = std::uint16_t(half);
    tile.message.tiles = 2;
    tile.message.frame = frame;
    tile.message.capture_stamp_ns = stamp_of(frame);
    tile.message.eye_from_world =
        messages::to_wire(config::eye_from_world(view, config::eye_from_world_at(viewer, 0)));
    tile.message.recon = messages::to_wire(view.recon);
    tile.message.rect = {16 * half, 0, 16 * half + 16, 24};
    return tile;
  }
  // A tile of the light's view, which has two. `depth_m`: of all of its pixels; 0: no hull.
  Tile light_tile(std::uint64_t frame, int half, float depth_m) const {
    const config::HullView view = *config::light_view(deployment_.scene);
    Tile tile = this->tile(frame, half);
    messages::set_text(tile.message.viewer, view.name);
    tile.message.eye_from_world = messages::to_wire(*view.fixed);
    tile.message.recon = messages::to_wire(view.recon);
    tile.message.rect = {20 * half, 0, 20 * half + 20, 40};
    if (depth_m > 0) {
      tile.message.covered = tile.message.rect;
      tile.depth_m.assign(800, depth_m);
    }
    return tile;
  }
  void send_hull(std::uint64_t frame, std::size_t eye = 0) {
    deliver(tiles_, tile(frame, 0, eye).wire());
    deliver(tiles_, tile(frame, 1, eye).wire());
  }
  // The ball is at x_m.
  void send_state(std::uint64_t frame, double x_m = 0, const char* object = "ball",
                  double quaternion_w = 1) {
    fivepipe_v1_ObjectState state{};
    messages::set_text(state.object, object);
    state.world_from_object = {{x_m, 0, -0.2}, {0, 0, 0, quaternion_w}};
    std::vector<fivepipe_v1_ObjectState> objects{state};
    fivepipe_v1_VirtualState message{};
    messages::set_text(message.simulation, "simulation");
    message.frame = frame;
    message.capture_stamp_ns = stamp_of(frame);
    messages::borrow(message.objects, objects);
    deliver(*states_, message);
  }
  // A grain at x_m.
  void send_particle(std::uint64_t frame, double x_m, const char* source = "grains") {
    std::vector<float> p_m{float(x_m), 0, 0};
    fivepipe_v1_Particles message{};
    messages::set_text(message.source, source);
    message.frame = frame;
    message.capture_stamp_ns = stamp_of(frame);
    messages::borrow(message.p_m, p_m);
    deliver(particles_, message);
  }
  void send_collision(std::uint64_t frame, const char* object, fivepipe_v1_CollisionVerdict verdict,
                      bool first_contact = false) {
    std::vector<fivepipe_v1_FirstContact> contacts(first_contact ? 1 : 0);
    fivepipe_v1_CollisionResult message{};
    messages::set_text(message.object, object);
    message.frame = frame;
    message.capture_stamp_ns = stamp_of(frame);
    message.verdict = verdict;
    messages::borrow(message.first_contact, contacts);
    deliver(collisions_, message);
  }
  // A collision of `object` with one collision point, and with a move of it to cp_hull_m, if given.
  void send_point(std::uint64_t frame, const char* object, const fivepipe_v1_Vec3& p_m,
                  const std::optional<fivepipe_v1_Vec3>& cp_hull_m = {}) {
    std::vector<fivepipe_v1_Vec3> points_m{p_m};
    fivepipe_v1_CollisionResult message{};
    messages::set_text(message.object, object);
    message.frame = frame;
    message.capture_stamp_ns = stamp_of(frame);
    message.verdict = fivepipe_v1_colliding;
    messages::borrow(message.points_m, points_m);
    if (cp_hull_m) {
      message.response = fivepipe_v1_recovered;
      message.cp_object_m = p_m;
      message.cp_hull_m = *cp_hull_m;
    }
    deliver(collisions_, message);
  }
  // Sends a tile that the node drops, and waits until it has counted it: the node has then taken
  // all earlier tiles.
  void wait_until_taken() {
    Tile unusable = tile(0, 0);
    unusable.message.eye_from_world.rotation.w = 2;
    const std::uint64_t before = drops_of(report(), "bad_tile");
    deliver(tiles_, unusable.wire());
    ASSERT_TRUE(holds([&] { return drops_of(report(), "bad_tile") > before; })) << said();
  }
  // Waits until `count` frames are composited.
  bool has_composited(std::size_t count) {
    return holds([&] { return composited_.take().size() >= count; });
  }
  std::vector<std::uint64_t> composited_frames() const {
    std::vector<std::uint64_t> frames;
    for (const Composited& one : composited_.all()) frames.push_back(one.frame);
    return frames;
  }
  // The still image once it is written.
  cv::Mat still() {
    const std::filesystem::path file = out_ / "composite.png";
    EXPECT_TRUE(holds([&] { return std::filesystem::exists(file); })) << said();
    const cv::Mat image = cv::imread(file);
    EXPECT_EQ(image.size(), cv::Size(config::composite_width_px(deployment_.viewer), 48));
    return image.empty() ? cv::Mat::zeros(48, 64, CV_8UC3) : image;
  }
  // The pixel of the image that shows a point of the plane y = 0.
  static cv::Vec3b at(const cv::Mat& image, double x_m, double z_m) {
    const double f_px = 32 / std::tan(30 * M_PI / 180);
    return image.at<cv::Vec3b>(int(std::lround(23.5 - f_px * z_m)),
                               int(std::lround(31.5 + f_px * x_m)));
  }
  // Whether the ball is at x_m in the image.
  static bool has_ball_at(const cv::Mat& image, double x_m) {
    const cv::Vec3b bgr = at(image, x_m, -0.2);
    return bgr[1] > 2 * bgr[0] && bgr[1] > 2 * bgr[2];
  }
  // Whether the image shows a grain at this point of the plane z = 0.
  static bool is_blue_at(const cv::Mat& image, double x_m) {
    const cv::Vec3b bgr = at(image, x_m, 0);
    return bgr[0] > 2 * bgr[2] && bgr[0] > 80;
  }
  // The boxes that are red in the image.
  static std::set<std::string> red_boxes(const cv::Mat& image) {
    std::set<std::string> red;
    double x_m = -0.4;
    for (const char* box : {"touched", "free", "undecided", "met", "scenery"}) {
      const cv::Vec3b bgr = at(image, x_m, 0.2);
      if (bgr[2] > 1.5 * bgr[0] && bgr[2] > 1.5 * bgr[1]) red.insert(box);
      x_m += 0.2;
    }
    return red;
  }
};

}  // namespace fivepipe::test
