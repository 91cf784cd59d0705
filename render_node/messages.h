// Converts HullTile and VirtualState messages to pure types, and results to FrameComposited.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/pipeline/messages/camera_messages.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "render_node/renderer.h"
#include "render_node/tile_assembler.h"

namespace fivepipe::render {

// Converts a tile message. The spans of the result refer to the message's storage. Returns
// BadMessage if the pose is not finite or not a rotation; TileAssembler validates everything else.
messages::Received<ReceivedTile> tile_from(const fivepipe_v1_HullTile& message);

// Converts the poses of all objects. Returns BadMessage if a pose is not finite or not a rotation;
// Renderer validates everything else.
messages::Received<std::vector<ObjectPose>> poses_from(const fivepipe_v1_VirtualState& message);

fivepipe_v1_FrameComposited composited_message(const std::string& viewer, const HullFrame& hull,
                                               std::int64_t composited_stamp_ns);

}  // namespace fivepipe::render
