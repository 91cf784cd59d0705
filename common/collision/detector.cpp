#include "common/collision/detector.h"

#include "common/collision/detection.h"
#include "common/collision/gl_detection.h"

namespace fivepipe {
namespace {

class CpuDetector : public CollisionDetector {
 public:
  explicit CpuDetector(const DetectionOptions& options) : options_(options) {}
  void set_hull(const HullQuery& query, std::span<const Silhouette>) override { query_ = &query; }

 private:
  std::vector<ObjectCollision> find(std::span<const DetectionObject> objects, DetectorCounts&) override {
    const std::span<const ObjectCollision> found = detection_.detect(*query_, objects, options_);
    return {found.begin(), found.end()};
  }

  DetectionOptions options_;
  CpuDetection detection_;
  const HullQuery* query_ = nullptr;
};

class GlDetector : public CollisionDetector {
 public:
  explicit GlDetector(const DetectionOptions& options) : options_(options) {}
  void set_hull(const HullQuery& query, std::span<const Silhouette>) override { detection_.set_hull(query); }

 private:
  std::vector<ObjectCollision> find(std::span<const DetectionObject> objects, DetectorCounts& counts) override {
    GlDetectionCounts own;
    const std::span<const ObjectCollision> found = detection_.detect(objects, options_, &own);
    counts.points_unconfirmed += own.unconfirmed;
    return {found.begin(), found.end()};
  }

  DetectionOptions options_;
  GlDetection detection_;
};

class PaperDetector : public CollisionDetector {
 public:
  PaperDetector(int window_px, int viewport_px) : query_(window_px, viewport_px) {}
  void set_hull(const HullQuery&, std::span<const Silhouette> silhouettes) override { query_.set_silhouettes(silhouettes); }

 private:
  std::vector<ObjectCollision> find(std::span<const DetectionObject> objects, DetectorCounts& counts) override {
    std::vector<std::vector<Triangle>> triangles_world_m;
    for (const DetectionObject& o : objects) triangles_world_m.push_back(world_triangles(o.tree->mesh(), o.world_from_object));
    Detection detection = fivepipe::detect(query_, triangles_world_m);
    counts.points_unconfirmed += detection.counts.points_unconfirmed;
    return std::move(detection.objects);
  }

  TriangleVolumeQuery query_;
};

}  // namespace

std::vector<ObjectCollision> CollisionDetector::detect(std::span<const DetectionObject> objects) {
  std::vector<ObjectCollision> collisions = find(objects, counts_);
  counts_.objects += objects.size();
  for (const ObjectCollision& c : collisions) {
    counts_.colliding += c.colliding();
    counts_.touching += c.verdict == CollisionVerdict::touching;
  }
  return collisions;
}

std::unique_ptr<CollisionDetector> cpu_detector(const DetectionOptions& options) { return std::make_unique<CpuDetector>(options); }
std::unique_ptr<CollisionDetector> gl_detector(const DetectionOptions& options) { return std::make_unique<GlDetector>(options); }
std::unique_ptr<CollisionDetector> paper_detector(int window_px, int viewport_px) { return std::make_unique<PaperDetector>(window_px, viewport_px); }

}  // namespace fivepipe
