// The detector of backend `gl`.
#pragma once
#include <memory>

#include "common/collision/detection/detection.h"

namespace fivepipe::collision {

// The same by compute shaders (gl_detection.h). Needs a current OpenGL 4.5 context for making, use
// and destruction. Throws GlError.
std::unique_ptr<CollisionDetector> gl_detector(const DetectionOptions& options);

}  // namespace fivepipe::collision
