#include "common/pipeline/messages/view_messages.h"

namespace fivepipe::messages {

fivepipe_v1_ViewInfo view_info_message(const config::Viewer& viewer) {
  fivepipe_v1_ViewInfo message{};
  set_text(message.viewer, viewer.name);
  message.render = to_wire(config::render_pinhole(viewer));
  message.recon = to_wire(config::recon_pinhole(viewer));
  message.near_m = viewer.near_m;
  message.far_m = viewer.far_m;
  return message;
}

Received<ViewGeometry> view_geometry_from(const fivepipe_v1_ViewInfo& message,
                                          const config::Viewer& viewer) {
  const geometry::Pinhole recon = from_wire(message.recon);
  if (auto why = geometry::why_unusable({recon, Eigen::Isometry3d::Identity()}))
    return BadMessage{"bad_view", message.viewer, *why};
  // A peer's size could exceed the memory.
  if (recon.width_px != viewer.recon_width_px || recon.height_px != viewer.recon_height_px)
    return BadMessage{"bad_view", message.viewer, "image size differs from this node's deployment"};
  if (!(message.near_m > 0 && message.far_m > message.near_m && std::isfinite(message.far_m)))
    return BadMessage{"bad_view", message.viewer, "not 0 < near < far"};
  return ViewGeometry{recon, message.near_m, message.far_m};
}

const fivepipe_v1_HeadPose& OutgoingPose::message() {
  borrow(header.tile_owners, pose.tile_owners);
  return header;
}

OutgoingPose head_pose_message(const config::Viewer& viewer, FramePose pose) {
  OutgoingPose out{{}, std::move(pose)};
  set_text(out.header.viewer, viewer.name);
  out.header.frame = out.pose.frame;
  out.header.capture_stamp_ns = out.pose.capture_stamp_ns;
  out.header.eye_from_world = to_wire(out.pose.eye_from_world);
  return out;
}

Received<FramePose> head_pose_from(const fivepipe_v1_HeadPose& message) {
  const auto pose = from_wire(message.eye_from_world);
  if (!pose) return BadMessage{"bad_head_pose", message.viewer, "not finite or not a rotation"};
  if (const auto why = why_implausible(message.frame, message.capture_stamp_ns))
    return BadMessage{"bad_head_pose", message.viewer, *why};
  const auto owners = span_of(message.tile_owners);
  return FramePose{message.frame, message.capture_stamp_ns, *pose, {owners.begin(), owners.end()}};
}

}  // namespace fivepipe::messages
