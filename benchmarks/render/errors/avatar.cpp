#include "benchmarks/render/errors/avatar.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "benchmarks/render/oracle/hull_pixel.h"

namespace fivepipe::render_bench {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

std::vector<hull::Capsule> capsules_of(std::span<const capture::SyntheticPart> parts) {
  std::vector<hull::Capsule> capsules;
  for (const capture::SyntheticPart& part : parts) {
    const auto* capsule = std::get_if<hull::Capsule>(&part.shape);
    if (!capsule) throw std::runtime_error("the actor has a part that is no capsule");
    capsules.push_back(*capsule);
  }
  return capsules;
}

}  // namespace

Actor::Actor(const config::Deployment& deployment)
    : deployment_(deployment),
      config_(config::without_clock(config::capture_of_all_nodes(deployment))) {
  capsules_of(capture::synthetic_parts(world(), 0));
}

std::vector<ActorFrame> Actor::frames(int count) const {
  const double period_frames = world().period_s * deployment_.frame_rate_hz;
  std::vector<ActorFrame> frames;
  for (int i = 0; i < count; ++i) {
    const auto frame = std::int64_t(i * period_frames / count);
    const double t_s = double(frame) / deployment_.frame_rate_hz;
    std::vector<capture::SyntheticPart> parts = capture::synthetic_parts(world(), t_s);
    std::vector<hull::Capsule> object = capsules_of(parts);
    frames.push_back({frame, config::eye_from_world_at(deployment_.viewer, t_s), std::move(parts),
                      std::move(object)});
  }
  return frames;
}

CameraImages Actor::captured(const ActorFrame& frame) {
  if (!capture_)
    capture_ = std::make_unique<capture::Capture>(deployment_.rig, deployment_.viewer, config_,
                                                  deployment_.frame_rate_hz);
  CameraImages images;
  for (capture::CapturedCamera& captured : capture_->capture(frame.frame, true)) {
    if (captured.status != capture::CaptureStatus::captured)
      throw std::runtime_error("camera " + captured.camera + ": " + captured.reason);
    const auto camera = std::find_if(
        deployment_.rig.cameras.begin(), deployment_.rig.cameras.end(),
        [&](const config::RigCamera& of_rig) { return of_rig.name == captured.camera; });
    if (captured.pixels)
      images.silhouettes.push_back(
          {config::published_camera(*camera, frame.eye_from_world), std::move(*captured.pixels)});
    if (captured.colour) images.colours.push_back(std::move(*captured.colour));
  }
  return images;
}

std::vector<hull::Silhouette> Actor::exact_silhouettes(
    std::span<const hull::Capsule> object) const {
  std::vector<hull::Silhouette> silhouettes;
  for (const std::size_t index : config::shape_cameras(deployment_.rig)) {
    geometry::Camera camera = config::published_camera(deployment_.rig.cameras[index]);
    const geometry::Pinhole& k = camera.pinhole;
    camera.pinhole = geometry::resized(k, kFiner * k.width_px, kFiner * k.height_px);
    silhouettes.push_back(
        {camera, hull::true_object_pixels(object, camera, hull::PixelRule::center)});
  }
  return silhouettes;
}

hull::View recon_view(const config::Viewer& viewer, const ActorFrame& frame) {
  return {{config::recon_pinhole(viewer), frame.eye_from_world}, viewer.near_m, viewer.far_m};
}

render::HullFrame reconstructed(const CameraImages& images, const hull::View& view) {
  const geometry::Pinhole& k = view.camera.pinhole;
  config::ReconConfig config;
  config.backend = config::HullBackend::cpu;
  // Only backend sweep uses the volume.
  recon::Reconstructor reconstructor(config, Eigen::AlignedBox3d());
  const recon::Tile whole{0, {0, 0, k.width_px, k.height_px}};
  const bool want_colour = !images.colours.empty();
  const recon::ReconTile tile =
      reconstructor
          .reconstruct({images.silhouettes, {}, images.colours}, view, {&whole, 1}, want_colour)
          .front();
  std::vector<float> depth_m(whole.rect.area_px(), hull::kNoHull);
  std::vector<std::uint8_t> bgr(want_colour ? 3 * depth_m.size() : 0);
  const std::size_t row_px = std::size_t(tile.covered.width_px());
  for (int v = 0; v < tile.covered.height_px(); ++v) {
    const std::size_t from = std::size_t(v) * row_px,
                      to = std::size_t(tile.covered.v0_px + v) * std::size_t(k.width_px) +
                           std::size_t(tile.covered.u0_px);
    std::copy_n(&tile.depth_m[from], row_px, &depth_m[to]);
    if (want_colour) std::copy_n(&tile.bgr[3 * from], 3 * row_px, &bgr[3 * to]);
  }
  render::HullFrame hull = render::frame_of_depths(view.camera, std::move(depth_m));
  hull.bgr = std::move(bgr);
  return hull;
}

render::HullFrame true_surface(std::span<const hull::Capsule> object, const hull::View& view) {
  const geometry::Pinhole& k = view.camera.pinhole;
  std::vector<float> depth_m;
  for (int v = 0; v < k.height_px; ++v)
    for (int u = 0; u < k.width_px; ++u)
      depth_m.push_back(
          float(true_depth_m(object, geometry::ray_through(view.camera, Vector2d(u, v)))
                    .value_or(hull::kNoHull)));
  return render::frame_of_depths(view.camera, std::move(depth_m));
}

AvatarRenderer::AvatarRenderer(const config::Viewer& viewer)
    : viewer_(viewer), renderer_(config::Scene{}, viewer) {}

Drawn AvatarRenderer::draw(const render::HullFrame& hull) {
  renderer_.draw(hull, {}, {});
  Drawn drawn{{config::render_pinhole(viewer_), hull.eye_from_world},
              renderer_.image_bgr(),
              renderer_.depth_m()};
  // Above the rounding of window depths at the far plane.
  constexpr double kFar_m = 1e-3;
  for (int v = 0; v < drawn.depth_m.rows; ++v)
    for (float* z = drawn.depth_m.ptr<float>(v);
         z < drawn.depth_m.ptr<float>(v) + drawn.depth_m.cols; ++z)
      if (!(*z < viewer_.far_m - kFar_m)) *z = hull::kNoHull;
  return drawn;
}

std::optional<double> true_depth_m(std::span<const hull::Capsule> object,
                                   const geometry::Ray& ray) {
  std::optional<double> first;
  for (const hull::Capsule& capsule : object)
    if (const auto entry = hull::ray_entry(capsule, ray); entry && !(first && *first <= *entry))
      first = entry;
  return first;
}

bool is_in_image(const geometry::Camera& camera, const Vector3d& p_world_m) {
  const std::optional<Vector2d> uv = geometry::project(camera, p_world_m);
  const geometry::Pinhole& k = camera.pinhole;
  return uv && uv->x() >= -0.5 && uv->y() >= -0.5 && uv->x() < k.width_px - 0.5 &&
         uv->y() < k.height_px - 0.5;
}

bool sees(const geometry::Camera& camera, std::span<const hull::Capsule> object,
          const Vector3d& p_world_m) {
  if (!is_in_image(camera, p_world_m)) return false;
  const Vector3d center_m = geometry::camera_center_world_m(camera);
  const std::optional<double> entry = true_depth_m(object, {center_m, p_world_m - center_m});
  // The point itself is at 1, but for rounding: 2 um at 2 m.
  constexpr double kRoundingFraction = 1e-6;
  return entry && *entry >= 1 - kRoundingFraction;
}

}  // namespace fivepipe::render_bench
