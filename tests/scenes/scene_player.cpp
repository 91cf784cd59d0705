#include "tests/scenes/scene_player.h"

#include <algorithm>
#include <limits>

#include "capture_node/synthetic/shading.h"
#include "tests/support/capture/actor_silhouettes.h"

namespace fivepipe::test {
namespace {

// Renders only the frames that composite() needs.
config::CaptureConfig on_demand(config::CaptureConfig config) {
  config.synthetic.prerender = false;
  config.precomputed_frames = 0;
  return config;
}

config::ReconConfig on_cpu(config::ReconConfig config) {
  config.backend = config::HullBackend::cpu;
  return config;
}

std::vector<float> coordinates(const std::vector<Eigen::Vector3d>& points_m) {
  std::vector<float> coordinates_m;
  for (const Eigen::Vector3d& p : points_m)
    coordinates_m.insert(coordinates_m.end(), {float(p.x()), float(p.y()), float(p.z())});
  return coordinates_m;
}

// Returns the colours that the camera sees at the pixels of its silhouette: those of a synthetic
// camera, without noise.
hull::ColourRegion colours_of(const std::vector<capture::SyntheticPart>& parts,
                              const hull::Silhouette& silhouette) {
  const hull::PixelRect region = silhouette.pixels.bounds();
  hull::ColourRegion colour{silhouette.camera, silhouette.pixels, region,
                            std::vector<std::uint8_t>(3 * region.area_px())};
  std::uint8_t* levels = colour.bgr.data();
  for (int v = region.v0_px; v < region.v1_px; ++v)
    for (int u = region.u0_px; u < region.u1_px; ++u, levels += 3) {
      if (!silhouette.pixels.contains(u, v)) continue;
      const geometry::Ray ray = geometry::ray_through(silhouette.camera, {double(u), double(v)});
      double nearest = std::numeric_limits<double>::infinity();
      const capture::SyntheticPart* seen = nullptr;
      for (const capture::SyntheticPart& part : parts)
        if (const auto entry =
                std::visit([&](const auto& shape) { return ray_entry(shape, ray); }, part.shape);
            entry && *entry < nearest) {
          nearest = *entry;
          seen = &part;
        }
      if (!seen) continue;
      const Eigen::Vector3f bgr = capture::shaded(
          *seen, ray.origin_world_m + nearest * ray.direction_world, ray.origin_world_m);
      for (int c = 0; c < 3; ++c) levels[c] = std::uint8_t(std::clamp(bgr[c], 0.0f, 255.0f) + 0.5f);
    }
  return colour;
}

}  // namespace

config::Deployment shipped_deployment(const std::string& name) {
  return config::load_deployment(std::filesystem::path(FIVEPIPE_SOURCE_DIR) / "launch/deployments" /
                                 (name + ".yaml"));
}

ScenePlayer::ScenePlayer(const config::Deployment& deployment)
    : deployment_(deployment),
      light_(config::light_view(deployment.scene)),
      simulation_(deployment.scene, node_config<config::SimConfig>(deployment),
                  deployment.rig.volume_m),
      reconstructor_(on_cpu(node_config<config::ReconConfig>(deployment)), deployment.rig.volume_m),
      renderer_(deployment.scene, deployment.viewer) {}

std::vector<capture::SyntheticPart> ScenePlayer::parts_now() const {
  return capture::synthetic_parts(node_config<config::CaptureConfig>(deployment_).synthetic,
                                  time_s());
}

void ScenePlayer::simulate(std::int64_t first_frame, std::int64_t last_frame) {
  const std::vector<geometry::Camera> cameras = cameras_of(deployment_.rig);
  for (frame_ = first_frame;; ++frame_) {
    silhouettes_ = silhouettes_of(parts_now(), cameras);
    simulation_.advance_to(time_s(), silhouettes_);
    if (frame_ >= last_frame) return;
  }
}

cv::Mat ScenePlayer::composite() {
  const std::vector<capture::SyntheticPart> parts = parts_now();
  std::vector<hull::ColourRegion> colours;
  for (const hull::Silhouette& silhouette : silhouettes_)
    colours.push_back(colours_of(parts, silhouette));
  return composite(silhouettes_, colours);
}

cv::Mat ScenePlayer::composite_of_images() {
  if (!capture_)
    capture_.emplace(deployment_.rig, deployment_.viewer,
                     on_demand(node_config<config::CaptureConfig>(deployment_)),
                     deployment_.frame_rate_hz);
  std::vector<hull::Silhouette> silhouettes;
  std::vector<hull::ColourRegion> colours;
  const std::vector<capture::CapturedCamera> captured = capture_->capture(frame_, true);
  for (std::size_t i = 0; i < captured.size(); ++i) {
    if (captured[i].pixels)
      silhouettes.push_back(
          {config::published_camera(deployment_.rig.cameras[i]), *captured[i].pixels});
    if (captured[i].colour) colours.push_back(*captured[i].colour);
  }
  return composite(silhouettes, colours);
}

cv::Mat ScenePlayer::composite(std::span<const hull::Silhouette> silhouettes,
                               std::span<const hull::ColourRegion> colours) {
  const Eigen::Isometry3d eye_from_world = config::eye_from_world_at(deployment_.viewer, time_s());
  const render::HullFrame hull =
      seen_hull({{config::recon_pinhole(deployment_.viewer), eye_from_world},
                 deployment_.viewer.near_m,
                 deployment_.viewer.far_m},
                silhouettes, colours);
  std::optional<render::HullFrame> light_hull;
  if (light_)
    light_hull = seen_hull({{light_->recon, *light_->fixed}, light_->near_m, light_->far_m},
                           silhouettes, {});
  renderer_.draw(hull, poses(), highlighted(), particles(), light_hull ? &*light_hull : nullptr);
  return renderer_.image_bgr();
}

// Reconstructs the view in one tile.
render::HullFrame ScenePlayer::seen_hull(const hull::View& view,
                                         std::span<const hull::Silhouette> silhouettes,
                                         std::span<const hull::ColourRegion> colours) {
  const geometry::Pinhole& pinhole = view.camera.pinhole;
  const recon::ReconTile made = reconstructor_.reconstruct(
      {silhouettes, {}, colours}, view, recon::tiles_of(pinhole.width_px, pinhole.height_px, 1, 1),
      !colours.empty())[0];
  render::ReceivedTile tile;
  tile.tiles = 1;
  tile.eye_from_world = view.camera.camera_from_world;
  tile.recon = pinhole;
  tile.rect = made.tile.rect;
  tile.covered = made.covered;
  tile.depth_m = made.depth_m;
  tile.bgr = made.bgr;
  render::TileAssembler assembler(pinhole, view.near_m, view.far_m);
  render::AddedTile added = assembler.add(tile);
  if (const auto* refused = std::get_if<render::RefusedTile>(&added))
    throw std::logic_error(refused->reason);
  return std::get<render::HullFrame>(std::move(added));
}

// The states that sim_node sends: not those of objects that never change.
std::vector<render::ObjectPose> ScenePlayer::poses() const {
  std::vector<render::ObjectPose> poses;
  const std::vector<sim::ObjectState> states = simulation_.states();
  for (std::size_t i = 0; i < states.size(); ++i)
    if (deployment_.scene.objects[i].motion != config::Motion::fixed ||
        !states[i].vertices_m.empty() || !states[i].warmth.empty())
      poses.push_back({states[i].name, states[i].world_from_object,
                       coordinates(states[i].vertices_m), states[i].warmth});
  return poses;
}

std::set<std::string> ScenePlayer::highlighted() const {
  std::set<std::string> names;
  for (const sim::CollisionReport& report : simulation_.collisions())
    if (deployment_.scene.objects[report.object].reaction == config::Reaction::highlight &&
        (report.collision.colliding() || report.details.first_contact))
      names.insert(report.name);
  return names;
}

std::vector<render::ParticleCloud> ScenePlayer::particles() const {
  std::vector<render::ParticleCloud> clouds;
  for (std::size_t i = 0; i < deployment_.scene.particles.size(); ++i)
    clouds.push_back({i, coordinates(simulation_.particles(i).p_world_m)});
  return clouds;
}

}  // namespace fivepipe::test
