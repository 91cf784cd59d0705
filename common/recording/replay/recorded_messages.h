// Decodes recorded payloads of this build's types, without DDS.
#pragma once
#include <cstddef>
#include <span>

#include "common/config/deployment.h"
#include "common/pipeline/messages/camera_messages.h"
#include "common/pipeline/messages/view_messages.h"

namespace fivepipe::replay {

// Return BadMessage as the functions of messages:: do, and if the payload is damaged.
messages::Received<frames::CameraMap> map_from(std::span<const std::byte> cdr,
                                               const config::Rig& rig);
messages::Received<messages::CameraColour> colour_from(std::span<const std::byte> cdr,
                                                       const config::Rig& rig);
// Of any viewer; `viewer` is its name.
struct RecordedPose {
  std::string viewer;
  messages::FramePose pose;
};
messages::Received<RecordedPose> head_pose_from(std::span<const std::byte> cdr);

}  // namespace fivepipe::replay
