// Converts HullTile, VirtualState, CollisionResult and Particles messages to pure types, and
// results to FrameComposited.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/pipeline/messages/camera_messages.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "render_node/renderer.h"
#include "render_node/views/tile_assembler.h"

namespace fivepipe::render {

// All conversions from messages return BadMessage if frame number or capture stamp is implausible
// (wire_conversions.h).

// Converts a tile message. The spans of the result refer to the message's storage. Also returns
// BadMessage if the pose is not finite or not a rotation, or the rig lacks one of the empty
// cameras; TileAssembler validates everything else.
messages::Received<ReceivedTile> tile_from(const fivepipe_v1_HullTile& message,
                                           const config::Rig& rig);

// Converts the poses of all objects. Also returns BadMessage if there are more than the scene has,
// or a pose is not finite or not a rotation; Renderer validates everything else.
messages::Received<std::vector<ObjectPose>> poses_from(const fivepipe_v1_VirtualState& message,
                                                       const config::Scene& scene);

// What render_node takes from a CollisionResult: whether to highlight the object.
struct Highlight {
  std::uint64_t frame = 0;
  std::int64_t capture_stamp_ns = 0;
  bool collides = false;  // the object collides, or met the hull between two frames
};
messages::Received<Highlight> highlight_from(const fivepipe_v1_CollisionResult& message);

struct ReceivedParticles {
  std::uint64_t frame = 0;
  std::int64_t capture_stamp_ns = 0;
  ParticleCloud particles;
};
// Also returns BadMessage if the scene has no such source; Renderer validates the particles.
messages::Received<ReceivedParticles> particles_from(const fivepipe_v1_Particles& message,
                                                     const config::Scene& scene);

fivepipe_v1_FrameComposited composited_message(const std::string& viewer, const HullFrame& hull,
                                               std::int64_t composited_stamp_ns);

}  // namespace fivepipe::render
