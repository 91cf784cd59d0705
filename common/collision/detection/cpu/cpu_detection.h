// Backend `cpu`: which triangles collide with the visual hull, certified, and where (design,
// "Triangles").
//
//   1. tree        boxes of triangles, sixteen a vector: one camera without an object pixel in a
//   box's image certifies all of it free.
//   2. triangles   those that are left, sixteen a vector, likewise.
//   3. points      what is left is sampled at the spacing asked for, from parts that are not free:
//   every sample in the hull is a CP_i.
//   4. certainty   a triangle without a sample in the hull is split, and split again, until each
//   part is free, or one of them, or the middle
//                  of one, is in the hull. What is still mixed at kFinest of eps is asked in
//                  double, corner by corner; if none of that is in the hull either: touching.
//
// So `free` has no point in the hull, deep or not; `colliding` has at least one; `touching` has, if
// any, a part in the hull that is thinner than eps, unless there were too many parts to look at all
// (counted: over_budget). Nothing is carried over from frame to frame.
#pragma once
#include <memory>
#include <span>

#include "common/collision/detection/bvh.h"
#include "common/collision/detection/detection.h"
#include "common/hull/query/hull_query.h"

namespace fivepipe::collision {

struct CpuDetectionCounts {
  std::size_t boxes = 0, triangles_classified = 0, triangles_walked = 0, points_in_double = 0,
              over_budget = 0;  // over_budget: triangles
};

// Keeps its memory from call to call: for who asks every frame.
class CpuDetection {
 public:
  CpuDetection();
  ~CpuDetection();
  CpuDetection(CpuDetection&&) noexcept;
  CpuDetection& operator=(CpuDetection&&) noexcept;

  // By object as given; valid until the next call. In the hull's pool; the same bits for any number
  // of threads and order of a triangle's vertices. A hull of no object pixels: all free. Throws
  // std::invalid_argument where eps is too small, a number is not finite, or the hull's rule is not
  // Limits::all.
  std::span<ObjectCollision> detect(const hull::HullQuery& query,
                                    std::span<const DetectionObject> objects,
                                    const DetectionOptions& options = {},
                                    CpuDetectionCounts* counts = nullptr);

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

// The same, once.
std::vector<ObjectCollision> detect(const hull::HullQuery& query,
                                    std::span<const DetectionObject> objects,
                                    const DetectionOptions& options = {},
                                    CpuDetectionCounts* counts = nullptr);

}  // namespace fivepipe::collision
