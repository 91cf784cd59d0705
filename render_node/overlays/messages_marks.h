// Converts CollisionResult messages to the marks of the overlays.
#pragma once
#include "common/pipeline/messages/bad_message.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "render_node/overlays/collision_marks.h"

namespace fivepipe::render {

// Reads only what the overlays show of the object. Returns BadMessage if a part of that is invalid:
// a point that is not finite or farther than kMaxCoordinate_m, more points than
// config::kMaxCollisionPoints, more than one normal of a kind, a normal that is not a unit vector
// or has no CP_hull, or a proximity field that does not fit the object or has a value outside
// 0 .. cap_m. The caller has validated frame number and stamp (highlight_from()).
messages::Received<CollisionMarks> marks_from(const fivepipe_v1_CollisionResult& message,
                                              const OverlaidObject& object);

// Beyond every scene; a float is exact to 6 cm there.
inline constexpr double kMaxCoordinate_m = 1e6;
// Rounding of a unit vector in double, with a margin.
inline constexpr double kMaxUnitError = 1e-6;

}  // namespace fivepipe::render
