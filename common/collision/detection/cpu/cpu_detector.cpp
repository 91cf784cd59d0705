#include "common/collision/detection/cpu/cpu_detector.h"

#include "common/collision/detection/cpu/cpu_detection.h"

namespace fivepipe::collision {
namespace {

class CpuDetector : public CollisionDetector {
 public:
  explicit CpuDetector(const DetectionOptions& options) : options_(options) {}
  void set_hull(const hull::HullQuery& query, std::span<const hull::Silhouette>) override {
    query_ = &query;
  }

 private:
  std::span<ObjectCollision> find(std::span<const DetectionObject> objects,
                                  DetectorCounts&) override {
    return detection_.detect(*query_, objects, options_);
  }

  DetectionOptions options_;
  CpuDetection detection_;
  const hull::HullQuery* query_ = nullptr;
};

}  // namespace

std::unique_ptr<CollisionDetector> cpu_detector(const DetectionOptions& options) {
  return std::make_unique<CpuDetector>(options);
}

}  // namespace fivepipe::collision
