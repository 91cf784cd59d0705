// Where a view's tiles may have occupied voxels: blocks of voxels, projected as boxes onto tiles.
// Rays start there, and tiles without are skipped. Source: Zwart and Abram's beams, as "beam
// optimization" in Laine and Karras, "Efficient Sparse Voxel Octrees", I3D 2010.
#pragma once
#include <span>
#include <vector>

#include "benchmarks/hull/baselines/voxel_grid.h"
#include "common/hull/hull.h"

namespace fivepipe::baselines {

inline constexpr int kFrontTile_px = 8;

struct TileDepths {
  float begin_m, end_m;  // begin > end: no voxel
};

class VoxelFront {
 public:
  VoxelFront(const VoxelGrid& grid, const hull::View& view);
  int across() const { return across_; }  // tiles
  int down() const { return down_; }

  // Widens the depths, across() * down() row by row, by what the brick with this least corner
  // [voxels] has: all of it where words is null.
  void add_brick(const std::array<int, 3>& corner_voxel, const std::uint32_t* words,
                 std::span<TileDepths> depths) const;

 private:
  void add_cube(const std::array<float, 3>& middle, float half_voxels,
                std::span<TileDepths> depths) const;

  int across_, down_;
  // The view's pixel of the point (x, y, z) [voxels] is of_x x + of_y y + of_z z + of_1,
  // homogeneous, the third its depth [m].
  std::array<float, 3> of_x_, of_y_, of_z_, of_1_;
  float voxel_px_m_;  // a voxel's size in the view, times its depth
  float slack_m_;     // rounding of depths
};

}  // namespace fivepipe::baselines
