#include "benchmarks/render/errors/colour_error.h"

#include <algorithm>
#include <cmath>

#include "capture_node/synthetic/render.h"

namespace fivepipe::render_bench {

using Eigen::Vector2d;

cv::Mat true_image_bgr(const config::Viewer& viewer, const config::SyntheticWorld& world,
                       const ActorFrame& frame,
                       std::shared_ptr<const capture::Surroundings> surroundings) {
  config::RigCamera eye;
  eye.name = viewer.name;
  eye.source = eye.published = config::render_pinhole(viewer);
  eye.mount = config::Mount::viewer;  // renders the room at a lower resolution
  return capture::SyntheticCamera(world, eye, std::move(surroundings))
      .image(frame.parts, frame.eye_from_world);
}

std::vector<double> colour_differences(const Drawn& drawn, const cv::Mat& true_bgr,
                                       std::span<const hull::Capsule> object,
                                       std::span<const geometry::Camera> cameras) {
  std::vector<double> levels;
  for (int v = 0; v < drawn.bgr.rows; ++v)
    for (int u = 0; u < drawn.bgr.cols; ++u) {
      if (drawn.depth_m.at<float>(v, u) == hull::kNoHull) continue;
      const geometry::Ray ray = geometry::ray_through(drawn.camera, Vector2d(u, v));
      const std::optional<double> depth_m = true_depth_m(object, ray);
      if (!depth_m) continue;
      const Eigen::Vector3d p_m = ray.origin_world_m + *depth_m * ray.direction_world;
      if (std::none_of(cameras.begin(), cameras.end(),
                       [&](const geometry::Camera& camera) { return sees(camera, object, p_m); }))
        continue;
      for (int c = 0; c < 3; ++c)
        levels.push_back(
            std::abs(drawn.bgr.at<cv::Vec3b>(v, u)[c] - true_bgr.at<cv::Vec3b>(v, u)[c]));
    }
  return levels;
}

std::vector<geometry::Camera> colour_cameras(const config::Rig& rig, const ActorFrame& frame) {
  std::vector<geometry::Camera> cameras;
  for (const config::RigCamera& camera : rig.cameras)
    if (camera.gives_colour)
      cameras.push_back(config::published_camera(camera, frame.eye_from_world));
  return cameras;
}

std::vector<double> avatar_colour_differences(Actor& actor, std::span<const ActorFrame> frames) {
  const config::Viewer& viewer = actor.deployment().viewer;
  const auto surroundings = std::make_shared<const capture::Surroundings>(actor.world().seed);
  AvatarRenderer renderer(viewer);
  std::vector<double> levels;
  for (const ActorFrame& frame : frames) {
    const Drawn drawn =
        renderer.draw(reconstructed(actor.captured(frame), recon_view(viewer, frame)));
    const std::vector<double> of_frame =
        colour_differences(drawn, true_image_bgr(viewer, actor.world(), frame, surroundings),
                           frame.object, colour_cameras(actor.deployment().rig, frame));
    levels.insert(levels.end(), of_frame.begin(), of_frame.end());
  }
  return levels;
}

}  // namespace fivepipe::render_bench
