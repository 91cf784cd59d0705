// The detector of backend `cpu`.
#pragma once
#include <memory>

#include "common/collision/detection/detection.h"

namespace fivepipe::collision {

// Certified (cpu_detection.h).
std::unique_ptr<CollisionDetector> cpu_detector(const DetectionOptions& options);

}  // namespace fivepipe::collision
