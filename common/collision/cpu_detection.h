// Backend `cpu`: which triangles collide with the visual hull, certified, and where (design, "Triangles").
//
//   1. tree        boxes of triangles, sixteen a vector: one camera without an object pixel in a box's image certifies all of it free.
//   2. triangles   those that are left, sixteen a vector, likewise.
//   3. points      what is left is sampled at the spacing asked for, from parts that are not free: every sample in the hull is a CP_i.
//   4. certainty   a triangle without a sample in the hull is split, and split again, until each part is free, or one of them, or the middle
//                  of one, is in the hull. What is still mixed at kFinest of eps is asked in double, corner by corner; if none of that is in
//                  the hull either: touching.
//
// So `free` has no point in the hull, deep or not; `colliding` has at least one; `touching` has, if any, a part in the hull that is thinner
// than eps, unless there were too many parts to look at all (counted: undecided). Nothing is carried over from frame to frame.
#pragma once
#include <memory>
#include <span>

#include "common/collision/collision.h"
#include "common/collision/mesh_tree.h"
#include "common/hull/hull_query.h"

namespace fivepipe {

struct DetectionOptions {
  double eps_m = 0.5e-3;           // >= kLeastEps_m
  double spacing_m = 3e-3;         // at most, from a CP_i to the next on its triangle; 0: the verdict alone, with one CP_i a triangle
  std::size_t max_points = 4096;   // of an object; of more, these are spread evenly over what was found. Where that is more than
                                   // kMostFoundPerPoint times as many, samples are farther apart than asked for
};

struct DetectionObject {
  const MeshTree* tree;
  Eigen::Isometry3d world_from_object = Eigen::Isometry3d::Identity();
  Eigen::Vector3d rp_object_world_m = Eigen::Vector3d::Zero();  // the CP_i farthest from it is among the points, last of its triangle
};

inline constexpr double kLeastEps_m = 1e-6;  // what maps resolve, by a thousand
inline constexpr std::size_t kMostFoundPerPoint = 64;

struct CpuDetectionCounts {
  std::size_t boxes = 0, triangles_looked_at = 0, triangles_walked = 0, points_in_double = 0, undecided = 0;  // undecided: triangles
};

// Keeps its memory from call to call: for who asks every frame.
class CpuDetection {
 public:
  CpuDetection();
  ~CpuDetection();
  CpuDetection(CpuDetection&&) noexcept;
  CpuDetection& operator=(CpuDetection&&) noexcept;

  // By object as given; valid until the next call. In the hull's pool; the same bits for any number of threads and order of a triangle's
  // vertices. A hull of no object pixels: all free. Throws std::invalid_argument where eps is too small, a number is not finite, or the
  // hull's rule is not Limits::all.
  std::span<ObjectCollision> detect(const HullQuery& query, std::span<const DetectionObject> objects, const DetectionOptions& options = {},
                                    CpuDetectionCounts* counts = nullptr);

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

// The same, once.
std::vector<ObjectCollision> detect(const HullQuery& query, std::span<const DetectionObject> objects, const DetectionOptions& options = {},
                                    CpuDetectionCounts* counts = nullptr);

}  // namespace fivepipe
