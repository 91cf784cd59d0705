// Rival: the distance to the hull by a grid of voxels and its exact Euclidean distance transform:
// what a field of distances is commonly made by. Source: Felzenszwalb and Huttenlocher, "Distance
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

  // Asks the middle of each voxel of the box whether it is in the hull, in vector lanes and the
  // hull's pool, and transforms. Keeps its buffers. Throws std::invalid_argument where there would
  // be more than kMaxVoxels.
  void build(const hull::HullQuery& query, const Eigen::AlignedBox3d& box_world_m);

  // From the middle of p's voxel, p in the box, to the nearest middle in the hull; infinite where
  // there is none. Nothing is certain: hull thinner than a voxel may be missed. Of hull that is
  // not, within a voxel's diagonal.
  float distance_m(const Eigen::Vector3d& p_world_m) const;
  std::size_t voxels() const { return squared_.size(); }

  static constexpr double kMaxVoxels = 3e8;

 private:
  void ask(const hull::HullQuery& query, std::span<const hull::PointSimdCamera> cameras, int z);
  void transform(base::WorkerPool& pool, int axis);
  double voxel_m_;
  Eigen::Vector3d corner_world_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3i size_ = Eigen::Vector3i::Zero();
  std::vector<float> squared_;  // in voxels; x runs fastest
};

}  // namespace fivepipe::baselines
