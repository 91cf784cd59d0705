#include "common/collision/detection/detection.h"

namespace fivepipe::collision {

std::span<ObjectCollision> CollisionDetector::detect(std::span<const DetectionObject> objects) {
  const std::span<ObjectCollision> collisions = find(objects, counts_);
  counts_.objects += objects.size();
  for (const ObjectCollision& c : collisions) {
    counts_.colliding += c.colliding();
    counts_.undecided += c.verdict == CollisionVerdict::undecided;
  }
  return collisions;
}

}  // namespace fivepipe::collision
