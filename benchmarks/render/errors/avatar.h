// The actor of a deployment's synthetic cameras, and the avatar that the nodes make of it: capture,
// segmentation, reconstruction and drawing.
#pragma once
#include <memory>
#include <opencv2/core/mat.hpp>

#include "capture_node/capture.h"
#include "capture_node/synthetic/world.h"
#include "common/hull/oracle/analytic.h"
#include "recon_node/reconstruct.h"
#include "render_node/renderer.h"

namespace fivepipe::render_bench {

// A time of the deployment's synthetic world.
struct ActorFrame {
  std::int64_t frame;  // of capture_node
  Eigen::Isometry3d eye_from_world;
  std::vector<capture::SyntheticPart> parts;
  std::vector<hull::Capsule> object;  // the shapes of `parts`
};

// Cameras at a time, and what they saw.
struct CameraImages {
  std::vector<hull::Silhouette> silhouettes;
  std::vector<hull::ColourRegion> colours;
};

class Actor {
 public:
  // Throws std::runtime_error if the deployment has no capture_node, or its actor has a part that
  // is no capsule.
  explicit Actor(const config::Deployment& deployment);

  const config::Deployment& deployment() const { return deployment_; }
  const config::SyntheticWorld& world() const { return config_.synthetic; }
  // Frames spread evenly over a period of the actor.
  std::vector<ActorFrame> frames(int count) const;
  // What capture_node sends of a frame, with its noise and segmentation.
  CameraImages captured(const ActorFrame& frame);
  // Exact silhouettes of the cameras that give shape: maps with pixels that are kFiner times
  // smaller than theirs, set by their centres.
  std::vector<hull::Silhouette> exact_silhouettes(std::span<const hull::Capsule> object) const;

 private:
  config::Deployment deployment_;
  config::CaptureConfig config_;
  std::unique_ptr<capture::Capture> capture_;  // created by the first captured()
};

// A pixel of the paper's cameras sees 3 mm of the object. The error of the fine maps, half of their
// pixel, is 0.2 mm.
inline constexpr int kFiner = 8;

// The view of the frame's eye in the reconstruction's size.
hull::View recon_view(const config::Viewer& viewer, const ActorFrame& frame);
// The hull, reconstructed by recon_node's own code on its backend cpu, with colour if the images
// have any.
render::HullFrame reconstructed(const CameraImages& images, const hull::View& view);
// The true object in the place of its hull.
render::HullFrame true_surface(std::span<const hull::Capsule> object, const hull::View& view);

// What the renderer draws of a hull, without virtual objects.
struct Drawn {
  geometry::Camera camera;
  cv::Mat bgr, depth_m;  // CV_8UC3; CV_32F, 0 where the image shows no hull
};
// Needs a current GL context. Draws hulls without virtual objects, without light.
class AvatarRenderer {
 public:
  explicit AvatarRenderer(const config::Viewer& viewer);
  Drawn draw(const render::HullFrame& hull);

 private:
  config::Viewer viewer_;
  render::Renderer renderer_;
};

// Depth of the first point of the object on a ray of ray_through() [m], or nullopt.
std::optional<double> true_depth_m(std::span<const hull::Capsule> object, const geometry::Ray& ray);
// Returns true if the point is in the camera's image.
bool is_in_image(const geometry::Camera& camera, const Eigen::Vector3d& p_world_m);
// Returns true if a camera sees this point of the object's surface: it is in the image, and no
// other part of the object hides it.
bool sees(const geometry::Camera& camera, std::span<const hull::Capsule> object,
          const Eigen::Vector3d& p_world_m);

}  // namespace fivepipe::render_bench
