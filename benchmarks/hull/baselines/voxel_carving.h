// Rival: voxels carved from coarse to fine, then drawn.
// Sources: Szeliski, "Rapid Octree Construction from Image Sequences", CVGIP: Image Understanding
// 1993 (nodes of an octree against silhouettes: empty, full, or divided); Amanatides and Woo, "A
// Fast Voxel Traversal Algorithm for Ray Tracing", Eurographics 1987 (the view's rays through the
// grid, here through nested blocks).
//
// Done to be fair. Eight nodes and more are tested at a time, in vector lanes, by the rectangle
// that holds a node's image; counts over 4x4 cells say whether it holds no object pixel (carved
// away) or nothing else (the camera is not asked again below). From bricks of 8x8x8 down each brick
// is on its own, in lanes and threads. Single voxels are decided by their centre: the answer with
// no lean to either side, the one with the least mean error for its size. Voxels are bits nested as
// the octree is, so that rays skip empty bricks, blocks of four and of two; rays go in lanes and
// threads and start where their tile's first bricks may be.
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

// A voxel is occupied where its centre is in the hull. What is thinner than a voxel may be lost; an
// occupied voxel has a point of the hull in its middle.
class VoxelCarving {
 public:
  // Voxels of voxel_m from the volume's least corner, up to its greatest at least. Throws
  // std::invalid_argument where these are no volume and voxel, or more than kMaxBricks.
  VoxelCarving(const Eigen::AlignedBox3d& volume_world_m, double voxel_m);

  // Depth along the view's z [m] at which the ray through each pixel enters its first occupied
  // voxel between near and far, row-major; near itself inside one; kNoHull where it meets none.
  // depth_m has the view's width * height. `limits: all`. At most kMaxCarvingCameras, else
  // std::invalid_argument. Keeps its buffers from call to call. Does not depend on the pool's
  // threads.
  void depth(std::span<const hull::Silhouette> silhouettes, const hull::View& view,
             base::WorkerPool& pool, std::span<float> depth_m);

  const VoxelGrid& grid() const { return grid_; }  // as the last call left it

  static constexpr std::int64_t kMaxBricks = std::int64_t(1) << 26;  // an index of 256 MB to 1 GB

 private:
  struct MapCamera {
    hull::PixelRect bounds;
    ObjectPixelLookup lookup;
  };
  bool carve(std::span<const hull::Silhouette> silhouettes, base::WorkerPool& pool);
  void find_front(const hull::View& view, base::WorkerPool& pool);

  VoxelGrid grid_;
  std::vector<MapCamera> cameras_;
  CarvedNodes nodes_, children_, full_;  // of the level at hand; in the end, bricks
  std::vector<TileDepths> front_;
  int front_across_ = 0;
};

}  // namespace fivepipe::baselines
