#include "common/collision/detection/gl/gl_detector.h"

#include "common/collision/detection/gl/gl_detection.h"

namespace fivepipe::collision {
namespace {

class GlDetector : public CollisionDetector {
 public:
  explicit GlDetector(const DetectionOptions& options) : options_(options) {}
  void set_hull(const hull::HullQuery& query, std::span<const hull::Silhouette>) override {
    detection_.set_hull(query);
  }

 private:
  std::span<ObjectCollision> find(std::span<const DetectionObject> objects,
                                  DetectorCounts& counts) override {
    GlDetectionCounts own;
    const std::span<ObjectCollision> found = detection_.detect(objects, options_, &own);
    counts.points_unconfirmed += own.unconfirmed;
    return found;
  }

  DetectionOptions options_;
  GlDetection detection_;
};

}  // namespace

std::unique_ptr<CollisionDetector> gl_detector(const DetectionOptions& options) {
  return std::make_unique<GlDetector>(options);
}

}  // namespace fivepipe::collision
