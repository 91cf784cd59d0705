// The detector of backend `gl`.
#pragma once
#include <memory>

#include "common/collision/detection/detection.h"

namespace fivepipe::collision {

// Certified detection in compute shaders (gl_detection.h). Needs a current OpenGL 4.5 context for
// construction, use and destruction. Throws GlError.
std::unique_ptr<CollisionDetector> gl_detector(const DetectionOptions& options);

}  // namespace fivepipe::collision
