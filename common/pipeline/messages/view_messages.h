// Converts and validates ViewInfo and HeadPose. capture_node writes them, recon_node reads them.
#pragma once
#include <cstdint>
#include <vector>

#include "common/config/deployment.h"
#include "common/pipeline/messages/camera_messages.h"

namespace fivepipe::messages {

fivepipe_v1_ViewInfo view_info_message(const config::Viewer& viewer);
struct ViewGeometry {
  geometry::Pinhole recon;
  double near_m, far_m;
};
// Returns BadMessage unless sizes and focal lengths are positive, the reconstruction image has the
// size of this node's deployment, and 0 < near < far.
Received<ViewGeometry> view_geometry_from(const fivepipe_v1_ViewInfo& message,
                                          const config::Viewer& viewer);

struct FramePose {
  std::uint64_t frame;
  std::int64_t capture_stamp_ns;
  Eigen::Isometry3d eye_from_world;
  std::vector<std::uint8_t> tile_owners;  // worker index by tile; empty: round-robin
};
// A HeadPose message and the storage of its sequence. The reference that message() returns is valid
// until the struct is moved.
struct OutgoingPose {
  fivepipe_v1_HeadPose header{};
  FramePose pose;
  const fivepipe_v1_HeadPose& message();
};
OutgoingPose head_pose_message(const config::Viewer& viewer, FramePose pose);
// Returns BadMessage unless the pose is finite and a rotation, and frame number and capture stamp
// are plausible (wire_conversions.h).
Received<FramePose> head_pose_from(const fivepipe_v1_HeadPose& message);

}  // namespace fivepipe::messages
