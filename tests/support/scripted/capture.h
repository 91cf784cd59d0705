// Plays capture_node for one real node: publishes the object pixels, colours and poses of a ball.
#pragma once
#include <cmath>

#include "common/base/realtime.h"
#include "common/config/deployment.h"
#include "common/hull/oracle/analytic.h"
#include "common/pipeline/messages/camera_messages.h"
#include "tests/support/scripted/peer.h"

namespace fivepipe::test {

class ScriptedCapture : public ScriptedPeer {
 protected:
  using Bgr = std::array<std::uint8_t, 3>;

  bus::Writer<bus::topics::CameraInfo> infos_ = bus_.writer<bus::topics::CameraInfo>();
  bus::Writer<bus::topics::ObjectPixelMap> maps_ = bus_.writer<bus::topics::ObjectPixelMap>();
  std::int64_t start_ns_ = base::now_realtime_ns();
  config::Deployment deployment_;

  // Writes a rig of three cameras, the scene and the deployment, and loads them. Returns the path
  // of the deployment. `nodes` is the list of its nodes, `viewer` further keys of its viewer.
  std::string three_cameras(const std::string& scene, const std::string& nodes,
                            const std::string& viewer = "") {
    file("rig.yaml", R"(
name: three
volume_m: {min: [-0.4, -0.4, -0.4], max: [0.4, 0.4, 0.4]}
cameras:
  - {name: front, image_size_px: [40, 30], horizontal_fov_deg: 40,
     look_at: {eye_m: [0, -1, 0.2], target_m: [0, 0, 0]}}
  - {name: side, image_size_px: [40, 30], horizontal_fov_deg: 40,
     look_at: {eye_m: [1, 0, 0.3], target_m: [0, 0, 0]}}
  - {name: back, image_size_px: [40, 30], horizontal_fov_deg: 40,
     look_at: {eye_m: [-0.7, 0.7, 0.2], target_m: [0, 0, 0]}}
)");
    file("scene.yaml", scene);
    const std::string path = file("deployment.yaml", R"(
name: scripted
rig: rig.yaml
scene: scene.yaml
viewer:
  path: [{t_s: 0, eye_m: [0, -0.8, 0], target_m: [0, 0, 0]}]
  near_m: 0.05
  far_m: 3
  recon_size_px: [24, 18]
)" + viewer + "nodes:\n" + nodes);
    deployment_ = config::load_deployment(path);
    return path;
  }

  std::int64_t stamp_of(std::uint64_t frame) const {
    return start_ns_ + 33'000'000 * std::int64_t(frame);
  }
  // The ball is elsewhere in every frame.
  virtual std::vector<hull::Capsule> ball_of(std::uint64_t frame) const {
    const double x_m = 0.03 * std::cos(double(frame)), z_m = 0.02 * double(frame % 3);
    return {{{x_m, 0, z_m}, {x_m, 0.05, z_m}, 0.09}};
  }
  std::vector<hull::Silhouette> silhouettes_of(std::uint64_t frame) const {
    const std::vector<hull::Capsule> ball = ball_of(frame);
    std::vector<hull::Silhouette> silhouettes;
    for (const config::RigCamera& camera : deployment_.rig.cameras) {
      const geometry::Camera published = config::published_camera(camera);
      silhouettes.push_back(
          {published, hull::true_object_pixels(ball, published, hull::PixelRule::touched)});
    }
    return silhouettes;
  }
  // later_ns: added to the frame's stamp. silent: the name of a camera without a map.
  void send_maps(std::uint64_t frame, std::int64_t later_ns = 0, const std::string& silent = "") {
    std::size_t camera = 0;
    for (const hull::Silhouette& silhouette : silhouettes_of(frame)) {
      const std::string& name = deployment_.rig.cameras[camera++].name;
      if (name == silent) continue;
      deliver(maps_,
              messages::map_message(name, frame, stamp_of(frame) + later_ns, silhouette.pixels)
                  .message());
    }
  }
};

}  // namespace fivepipe::test
