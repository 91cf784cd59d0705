#include "render_node/frame_painter.h"

#include <algorithm>
#include <vector>

#include "common/config/views.h"
#include "common/hull/hull.h"
#include "render_node/overlays/collision_marks.h"

namespace fivepipe::render {
namespace {

// Returns a frame that covers the whole image, so that the renderer draws the hull, and in which no
// pixel shows it.
HullFrame frame_without_hull(const config::HullView& view,
                             const Eigen::Isometry3d& eye_from_world) {
  HullFrame frame;
  frame.eye_from_world = eye_from_world;
  frame.recon = view.recon;
  frame.covered = {0, 0, view.recon.width_px, view.recon.height_px};
  frame.depth_m.assign(std::size_t(view.recon.width_px) * std::size_t(view.recon.height_px),
                       hull::kNoHull);
  return frame;
}

// Returns one of each that the scene may have, in the view of the eye: a particle, a collision
// point, an arrow.
VirtualFrame one_of_each(const config::Scene& scene, const config::Viewer& viewer,
                         const Eigen::Isometry3d& eye_from_world) {
  VirtualFrame frame;
  const double z_m = 2 * viewer.near_m;  // nearer, the near plane would clip them
  const Eigen::Isometry3d world_from_eye = eye_from_world.inverse();
  const Eigen::Vector3d start_world_m = world_from_eye * Eigen::Vector3d(0, 0, z_m),
                        tip_world_m = world_from_eye * Eigen::Vector3d(z_m, 0, z_m);
  const Eigen::Vector3f p_world_m = start_world_m.cast<float>();
  if (!scene.particles.empty())
    frame.particles = {{.source = 0, .p_world_m = {p_world_m.x(), p_world_m.y(), p_world_m.z()}}};
  // Empty exactly if the scene has no overlays: the configuration rejects one that shows nothing.
  if (const auto overlaid = overlaid_objects(scene); !overlaid.empty())
    frame.marks = {{.object = overlaid.begin()->second.object,
                    .points_world_m = {p_world_m},
                    .recovery = RecoveryMark{start_world_m, tip_world_m}}};
  return frame;
}

}  // namespace

FramePainter::FramePainter(const config::Deployment& deployment, const config::Viewer& viewer)
    : renderer_(deployment.scene, viewer) {
  if (!deployment.scene.overlays.empty()) overlays_.emplace(deployment.scene, viewer);
  warm_up(deployment, viewer);
}

void FramePainter::warm_up(const config::Deployment& deployment, const config::Viewer& viewer) {
  const Eigen::Isometry3d head_from_world = config::eye_from_world_at(viewer, 0);
  std::vector<HullFrame> eyes;
  for (const config::HullView& view : config::eye_views(viewer))
    eyes.push_back(frame_without_hull(view, config::eye_from_world(view, head_from_world)));
  std::optional<HullFrame> light;
  if (const auto view = config::light_view(deployment.scene))
    light = frame_without_hull(*view, *view->fixed);
  const VirtualFrame virtual_frame =
      one_of_each(deployment.scene, viewer, eyes.front().eye_from_world);
  draw(eyes, virtual_frame, light ? &*light : nullptr);
  if (std::ranges::any_of(deployment.rig.cameras, &config::RigCamera::gives_colour)) {
    for (HullFrame& eye : eyes) eye.bgr.resize(3 * eye.depth_m.size());
    draw(eyes, virtual_frame, light ? &*light : nullptr);
  }
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
