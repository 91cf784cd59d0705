// ViewInfo and HeadPose: wire <-> pure. capture_node writes them, recon_node reads them.
#pragma once
#include <cstdint>

#include "common/messages/camera_messages.h"
#include "common/scene/deployment.h"

namespace fivepipe {

fivepipe_v1_ViewInfo view_info_message(const Viewer& viewer);
struct ViewGeometry {
  Pinhole recon;
  double near_m, far_m;
};
// Bad: sizes or focal lengths not positive, not 0 < near < far.
Received<ViewGeometry> view_geometry_from(const fivepipe_v1_ViewInfo& message);

fivepipe_v1_HeadPose head_pose_message(const Viewer& viewer, std::uint64_t frame, std::int64_t capture_stamp_ns, const Eigen::Isometry3d& eye_from_world);
struct FramePose {
  std::uint64_t frame;
  std::int64_t capture_stamp_ns;
  Eigen::Isometry3d eye_from_world;
};
Received<FramePose> head_pose_from(const fivepipe_v1_HeadPose& message);

}  // namespace fivepipe
