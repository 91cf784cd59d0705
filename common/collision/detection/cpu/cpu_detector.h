// The detector of backend `cpu`.
#pragma once
#include <memory>

#include "common/collision/detection/detection.h"

namespace fivepipe::collision {

// Certified detection on the CPU (cpu_detection.h). Throws nothing; detect() checks the options.
std::unique_ptr<CollisionDetector> cpu_detector(const DetectionOptions& options);

}  // namespace fivepipe::collision
