#include "common/collision/detection/detection.h"

namespace fivepipe::collision {

std::vector<ObjectCollision> CollisionDetector::detect(std::span<const DetectionObject> objects) {
  std::vector<ObjectCollision> collisions = find(objects, counts_);
  counts_.objects += objects.size();
  for (const ObjectCollision& c : collisions) {
    counts_.colliding += c.colliding();
    counts_.undecided += c.verdict == CollisionVerdict::undecided;
  }
  return collisions;
}

}  // namespace fivepipe::collision
