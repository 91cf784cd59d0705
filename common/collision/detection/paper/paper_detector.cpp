#include "common/collision/detection/paper/paper_detector.h"

#include "common/collision/detection/bvh.h"
#include "common/collision/detection/paper/paper_detection.h"
#include "common/hull/query/hull_query.h"

namespace fivepipe::collision {
namespace {

class PaperDetector : public CollisionDetector {
 public:
  PaperDetector(int window_px, int viewport_px) : query_(window_px, viewport_px) {}
  void set_hull(const hull::HullQuery& query,
                std::span<const hull::Silhouette> silhouettes) override {
    query_.set_silhouettes(silhouettes, query.hull().rule());
  }

 private:
  std::span<ObjectCollision> find(std::span<const DetectionObject> objects,
                                  DetectorCounts& counts) override {
    std::vector<std::vector<Triangle>> triangles_world_m;
    for (const DetectionObject& o : objects)
      triangles_world_m.push_back(world_triangles(o.tree->mesh(), o.world_from_object));
    Detection detection = fivepipe::collision::detect(query_, triangles_world_m);
    collisions_ = std::move(detection.objects);
    counts.points_unconfirmed += detection.counts.points_unconfirmed;
    return collisions_;
  }

  TriangleVolumeQuery query_;
  std::vector<ObjectCollision> collisions_;  // of the last call
};

}  // namespace

std::unique_ptr<CollisionDetector> paper_detector(int window_px, int viewport_px) {
  return std::make_unique<PaperDetector>(window_px, viewport_px);
}

}  // namespace fivepipe::collision
