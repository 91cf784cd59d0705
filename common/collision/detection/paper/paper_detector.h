// The detector of the paper's method.
#pragma once
#include <memory>

#include "common/collision/detection/detection.h"

namespace fivepipe::collision {

// Samples triangles in viewports of viewport_px squared (paper_detection.h) in a window of
// window_px squared. Needs a current OpenGL 4.5 context for construction, use and destruction.
// Throws as the constructor of TriangleVolumeQuery.
std::unique_ptr<CollisionDetector> paper_detector(int window_px, int viewport_px);

}  // namespace fivepipe::collision
