// HullTile, VirtualState and CollisionResult in; FrameComposited out.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/pipeline/messages/camera_messages.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "render_node/renderer.h"
#include "render_node/tile_assembler.h"

namespace fivepipe::render {

// Refers to the message's storage. Bad: a pose that is not finite; everything else is
// TileAssembler' to judge.
messages::Received<ReceivedTile> tile_from(const fivepipe_v1_HullTile& message);

// Bad: a pose that is not finite.
messages::Received<std::vector<ObjectPose>> poses_from(const fivepipe_v1_VirtualState& message);

fivepipe_v1_FrameComposited composited_message(const std::string& viewer, const HullFrame& hull,
                                               std::int64_t composited_stamp_ns);

}  // namespace fivepipe::render
