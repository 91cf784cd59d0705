// Baseline: voxel carving from coarse to fine, and ray casting of the voxels.
// Sources: Szeliski, "Rapid Octree Construction from Image Sequences", CVGIP: Image Understanding
// 1993 (tests octree nodes against silhouettes: empty, full or divided); Amanatides and Woo, "A
// Fast Voxel Traversal Algorithm for Ray Tracing", Eurographics 1987 (here through nested blocks).
//
// Optimised for a fair comparison:
// - SIMD tests at least eight nodes at a time, by the rectangle around a node's image. Counts over
//   4x4 cells report whether it holds no object pixel (the node is carved away) or only object
//   pixels (the camera is not tested again in the node's children).
// - Below bricks of 8x8x8 voxels, each brick is processed on its own, with SIMD and threads.
// - A single voxel is decided by its center, which has no bias and the smallest mean error.
// - Voxels are bits in the order of the octree, so that rays skip empty bricks, blocks of four and
//   blocks of two. Rays use SIMD and threads, and start at the first brick that their tile may see.
#pragma once
#include <span>
#include <vector>

#include "benchmarks/hull/baselines/object_pixel_lookup.h"
#include "benchmarks/hull/baselines/voxel_front.h"
#include "benchmarks/hull/baselines/voxel_grid.h"
#include "benchmarks/hull/baselines/voxel_simd.h"
#include "common/base/worker_pool.h"
#include "common/hull/hull.h"

namespace fivepipe::baselines {

inline constexpr std::size_t kMaxCarvingCameras = 31;

// A voxel is occupied if its center is in the hull. Parts of the hull that are thinner than a voxel
// may be lost.
class VoxelCarving {
 public:
  // The grid starts at the volume's minimum corner and covers the volume. Throws
  // std::invalid_argument if the volume or the voxel is empty, or if there are more than
  // kMaxBricks.
  VoxelCarving(const Eigen::AlignedBox3d& volume_world_m, double voxel_m);

  // Writes the depth in m along the view's z at which the ray through each pixel enters its first
  // occupied voxel between near and far, row-major: near_m if it starts inside one, kNoHull if it
  // meets none. depth_m has the view's width * height elements. The hull rule is `limits: all`.
  // Throws std::invalid_argument for more than kMaxCarvingCameras cameras. Keeps its buffers from
  // call to call. The result does not depend on the pool's threads.
  void depth(std::span<const hull::Silhouette> silhouettes, const hull::View& view,
             base::WorkerPool& pool, std::span<float> depth_m);

  const VoxelGrid& grid() const { return grid_; }  // of the last call

  static constexpr std::int64_t kMaxBricks = std::int64_t(1) << 26;  // an index of 256 MiB to 1 GiB

 private:
  struct MapCamera {
    hull::PixelRect bounds;
    ObjectPixelLookup lookup;
  };
  bool carve(std::span<const hull::Silhouette> silhouettes, base::WorkerPool& pool);
  void find_front(const hull::View& view, base::WorkerPool& pool);

  VoxelGrid grid_;
  std::vector<MapCamera> cameras_;
  CarvedNodes nodes_, children_, full_;  // of the current level; at the end, bricks
  std::vector<TileDepths> front_;
  int front_across_ = 0;
};

}  // namespace fivepipe::baselines
