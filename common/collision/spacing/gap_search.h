// Narrows the spacings that a sweep left undecided.
#pragma once
#include "common/collision/detection/detection.h"
#include "common/collision/spacing/spacing_sweep.h"

namespace fivepipe::collision {

// An undecided interval that is not longer stays as it is: beside spacings that are free, and
// between two at which the part touches the hull.
inline constexpr double kNarrowGap_m = 0.2e-3, kNarrowestGap_m = 1e-9;

// Detects the part at spacings that are neither free nor touching, and adds to `touching` the
// intervals in which a collision point that it finds stays in the hull. `verdicts` are of this
// part, range and query; the detector's hull is that of the query. The number of detections is
// limited.
void narrow_gaps(SpacingVerdicts& verdicts, const MovablePart& part, const SpacingInterval& range,
                 const hull::HullQuery& query, CollisionDetector& detector);

}  // namespace fivepipe::collision
