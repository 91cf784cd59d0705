// Baseline: the distance to the hull from a voxel grid and its exact Euclidean distance transform,
// the usual way to compute a distance field. Source: Felzenszwalb and Huttenlocher, "Distance
// Transforms of Sampled Functions", Theory of Computing 8, 2012: lower envelopes of parabolas, axis
// by axis.
#pragma once
#include <span>
#include <vector>

#include "common/hull/cpu/point_simd.h"
#include "common/hull/query/hull_query.h"

namespace fivepipe::baselines {

class DistanceGrid {
 public:
  // Throws std::invalid_argument unless voxel_m > 0.
  explicit DistanceGrid(double voxel_m);

  // Tests the center of each voxel of the box against the hull, with SIMD on the hull's pool, and
  // transforms the grid. Keeps its buffers. Throws std::invalid_argument for more than kMaxVoxels.
  void build(const hull::HullQuery& query, const Eigen::AlignedBox3d& box_world_m);

  // Returns the distance from the center of p's voxel to the nearest voxel center in the hull;
  // infinite if there is none. p must be in the box. The error is at most a voxel's diagonal,
  // except that parts of the hull thinner than a voxel may be missed.
  float distance_m(const Eigen::Vector3d& p_world_m) const;

  static constexpr double kMaxVoxels = 3e8;

 private:
  void test_layer(const hull::HullQuery& query, std::span<const hull::PointSimdCamera> cameras,
                  int z);
  void transform(base::WorkerPool& pool, int axis);
  double voxel_m_;
  Eigen::Vector3d corner_world_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3i size_ = Eigen::Vector3i::Zero();
  std::vector<float> squared_;  // squared distances in voxels; x varies fastest
};

}  // namespace fivepipe::baselines
