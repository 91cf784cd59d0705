// Backend `cpu`: certified verdicts and collision points of triangles against the visual hull
// (docs/collision.md).
//
//   1. BVH        16 boxes per SIMD vector: with Limits::all, one camera without an object pixel in
//                 a box's image certifies everything in the box free; contact_simd.h has the rule
//                 for Limits::seen.
//   2. triangles  The triangles of the remaining leaves are tested in the same way, 16 per vector.
//   3. points     The backend samples the parts of the remaining triangles that are not free at the
//                 requested spacing. Every sample in the hull is a collision point.
//   4. decision   A triangle without a sample in the hull is split until every part is free, or a
//                 part or the center of one is in the hull. Parts that are still mixed at a size of
//                 eps_m / kFinest are tested in double at their corners and centers. If no such
//                 point is in the hull, the triangle is undecided.
//
// So a `free` triangle has no point in the hull, however shallow, and a `colliding` one has at
// least one. A part of an `undecided` triangle that is in the hull, if there is any, is thinner
// than eps_m, unless the triangle had too many parts to test (counted in over_budget). The results
// for a frame do not depend on other frames.
#pragma once
#include <memory>
#include <span>

#include "common/collision/detection/bvh.h"
#include "common/collision/detection/detection.h"
#include "common/hull/query/hull_query.h"

namespace fivepipe::collision {

struct CpuDetectionCounts {
  // Numbers of one call. points_in_double: points that float could not decide. over_budget:
  // triangles with too many parts to test.
  std::size_t boxes = 0, triangles_classified = 0, triangles_walked = 0, points_in_double = 0,
              over_budget = 0;
};

// Reuses its memory from call to call.
class CpuDetection {
 public:
  CpuDetection();
  ~CpuDetection();

  // Returns one result per object, in the given order, valid until the next call. Runs in the
  // hull's pool. The bits do not depend on the number of threads or on the order of a triangle's
  // vertices. Without object pixels all objects are free. Throws std::invalid_argument if eps_m is
  // below kMinEps_m or a number is not finite.
  std::span<ObjectCollision> detect(const hull::HullQuery& query,
                                    std::span<const DetectionObject> objects,
                                    const DetectionOptions& options = {},
                                    CpuDetectionCounts* counts = nullptr);

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

// Calls CpuDetection::detect() once and returns the results, which own their memory.
std::vector<ObjectCollision> detect(const hull::HullQuery& query,
                                    std::span<const DetectionObject> objects,
                                    const DetectionOptions& options = {},
                                    CpuDetectionCounts* counts = nullptr);

}  // namespace fivepipe::collision
