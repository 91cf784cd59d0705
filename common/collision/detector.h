// One door to the backends that find collisions, for who has objects and, frame by frame, a hull.
#pragma once
#include <memory>

#include "common/collision/cpu_detection.h"

namespace fivepipe {

struct DetectorCounts {  // sums
  std::size_t objects = 0, colliding = 0, touching = 0;
  std::size_t points_unconfirmed = 0;  // paper: samples that OpenGL found in the hull and in_hull() did not. gl: triangles for which that happened
};

class CollisionDetector {
 public:
  virtual ~CollisionDetector() = default;
  // The hull that is asked from now on, and the silhouettes that it is of. Both must stay until the next.
  virtual void set_hull(const HullQuery& query, std::span<const Silhouette> silhouettes) = 0;
  // A hull has been set.
  std::vector<ObjectCollision> detect(std::span<const DetectionObject> objects);
  const DetectorCounts& counts() const { return counts_; }

 protected:
  virtual std::vector<ObjectCollision> find(std::span<const DetectionObject> objects, DetectorCounts& counts) = 0;

 private:
  DetectorCounts counts_;
};

// Certified (cpu_detection.h).
std::unique_ptr<CollisionDetector> cpu_detector(const DetectionOptions& options);
// The same by compute shaders (gl_detection.h). Needs a current OpenGL 4.5 context for making, use and destruction. Throws GlError.
std::unique_ptr<CollisionDetector> gl_detector(const DetectionOptions& options);
// The paper's sampling in viewports (detection.h). Needs a current OpenGL context for making, use and destruction. Throws as
// TriangleVolumeQuery does.
std::unique_ptr<CollisionDetector> paper_detector(int window_px, int viewport_px);

}  // namespace fivepipe
