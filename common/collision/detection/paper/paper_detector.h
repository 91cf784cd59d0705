// The detector of the paper's method.
#pragma once
#include <memory>

#include "common/collision/detection/detection.h"

namespace fivepipe::collision {

// The paper's sampling in viewports (detection.h). Needs a current OpenGL context for making, use
// and destruction. Throws as TriangleVolumeQuery does.
std::unique_ptr<CollisionDetector> paper_detector(int window_px, int viewport_px);

}  // namespace fivepipe::collision
