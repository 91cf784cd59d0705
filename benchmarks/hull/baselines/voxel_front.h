// The depth ranges in which a view's tiles may see occupied voxels, from blocks of voxels projected
// onto the tiles as boxes. Rays start there, and tiles without a range are skipped. Source: the
// "beam optimization" of Laine and Karras, "Efficient Sparse Voxel Octrees", I3D 2010.
#pragma once
#include <span>
#include <vector>

#include "benchmarks/hull/baselines/voxel_grid.h"
#include "common/hull/hull.h"

namespace fivepipe::baselines {

inline constexpr int kFrontTile_px = 8;

struct TileDepths {
  float begin_m, end_m;  // begin > end if there is no voxel
};

class VoxelFront {
 public:
  VoxelFront(const VoxelGrid& grid, const hull::View& view);
  int across() const { return across_; }  // tiles
  int down() const { return down_; }

  // Widens the depths (across() * down(), row by row) to include the occupied blocks of the brick
  // with this minimum corner (in voxels), or the whole brick if `words` is null.
  void add_brick(const std::array<int, 3>& corner_voxel, const std::uint32_t* words,
                 std::span<TileDepths> depths) const;

 private:
  void add_cube(const std::array<float, 3>& center, float half_voxels,
                std::span<TileDepths> depths) const;

  int across_, down_;
  // The pixel of the point (x, y, z), in voxels, is of_x x + of_y y + of_z z + of_1, homogeneous;
  // the third component is the depth in m.
  std::array<float, 3> of_x_, of_y_, of_z_, of_1_;
  float voxel_px_m_;  // a voxel's size in the view in px, times its depth in m
  float slack_m_;     // bound on the rounding of depths
};

}  // namespace fivepipe::baselines
