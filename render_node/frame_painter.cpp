#include "render_node/frame_painter.h"

#include <algorithm>

#include "common/config/views.h"
#include "common/hull/hull.h"

namespace fivepipe::render {
namespace {

HullFrame frame_without_hull(const config::HullView& view, const Eigen::Isometry3d& eye_from_world,
                             bool has_colour) {
  HullFrame frame;
  frame.eye_from_world = eye_from_world;
  frame.recon = view.recon;
  frame.covered = {0, 0, view.recon.width_px, view.recon.height_px};
  const std::size_t pixels = std::size_t(view.recon.width_px) * std::size_t(view.recon.height_px);
  frame.depth_m.assign(pixels, hull::kNoHull);
  if (has_colour) frame.bgr.resize(3 * pixels);
  return frame;
}

// One of each that the scene may have: a particle, a collision point, an arrow.
VirtualFrame one_of_each(const config::Scene& scene) {
  VirtualFrame frame;
  const Eigen::Vector3d p_world_m = Eigen::Vector3d::Zero();
  if (!scene.particles.empty()) frame.particles = {{.source = 0, .p_world_m = {0, 0, 0}}};
  if (!scene.overlays.empty())
    frame.marks = {{.object = overlaid_objects(scene).begin()->second.object,
                    .points_world_m = {p_world_m.cast<float>()},
                    .recovery = RecoveryMark{p_world_m, p_world_m + Eigen::Vector3d::UnitZ()}}};
  return frame;
}

}  // namespace

FramePainter::FramePainter(const config::Deployment& deployment, const config::Viewer& viewer)
    : renderer_(deployment.scene, viewer) {
  if (!deployment.scene.overlays.empty()) overlays_.emplace(deployment.scene, viewer);
  warm_up(deployment, viewer);
}

void FramePainter::warm_up(const config::Deployment& deployment, const config::Viewer& viewer) {
  const bool has_colour =
      std::ranges::any_of(deployment.rig.cameras, &config::RigCamera::gives_colour);
  const Eigen::Isometry3d head_from_world = config::eye_from_world_at(viewer, 0);
  std::vector<HullFrame> eyes;
  for (const config::HullView& view : config::eye_views(viewer))
    eyes.push_back(
        frame_without_hull(view, config::eye_from_world(view, head_from_world), has_colour));
  std::optional<HullFrame> light;
  if (const auto view = config::light_view(deployment.scene))
    light = frame_without_hull(*view, *view->fixed, false);
  draw(eyes, one_of_each(deployment.scene), light ? &*light : nullptr);
  renderer_.finish();
}

void FramePainter::draw(std::span<const HullFrame> eyes, const VirtualFrame& virtual_frame,
                        const HullFrame* light_hull) {
  renderer_.draw(eyes, virtual_frame.poses, virtual_frame.colliding, virtual_frame.particles,
                 light_hull);
  if (!overlays_) return;
  for (const ObjectPose& pose : virtual_frame.poses)
    overlays_->place(pose.object, pose.world_from_object, pose.vertices_m);
  for (std::size_t i = 0; i < eyes.size(); ++i)
    overlays_->draw(i, eyes[i].eye_from_world, virtual_frame.marks);
}

const OverlaidObject* FramePainter::overlaid(const std::string& object) const {
  return overlays_ ? overlays_->find(object) : nullptr;
}

}  // namespace fivepipe::render
