// Conversion of SpacingRequest and to and from ObjectSpacing.
#pragma once
#include <cstdint>
#include <string>

#include "common/config/scene.h"
#include "common/pipeline/messages/bad_message.h"
#include "common/pipeline/messages/wire_conversions.h"

namespace fivepipe::sim {

// A spacing of an object of the scene, which has `spacing` and permits it.
struct SpacingChange {
  std::size_t object = 0;  // position in the scene
  double spacing_m = 0;
  std::int64_t capture_stamp_ns = 0;  // of the first frame with this spacing; 0: the next frame
};

// All return BadMessage ("bad_spacing") if the scene has no such object, the object has no spacing,
// or the spacing is not finite or out of its range; the third one also if frame or stamp is
// implausible. The first two hold from the next frame on.
messages::Received<SpacingChange> change_to(const std::string& object, double spacing_m,
                                            const config::Scene& scene);
messages::Received<SpacingChange> change_from(const fivepipe_v1_SpacingRequest& message,
                                              const config::Scene& scene);
messages::Received<SpacingChange> change_from(const fivepipe_v1_ObjectSpacing& message,
                                              const config::Scene& scene);

// requested: whether a SpacingRequest has set it.
fivepipe_v1_ObjectSpacing spacing_message(const std::string& object, std::uint64_t frame,
                                          std::int64_t capture_stamp_ns, double spacing_m,
                                          bool requested);

}  // namespace fivepipe::sim
