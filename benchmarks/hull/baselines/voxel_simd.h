// The SIMD kernels of voxel carving and ray casting.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "benchmarks/hull/baselines/object_pixel_lookup.h"
#include "benchmarks/hull/baselines/voxel_grid.h"
#include "common/hull/hull.h"

namespace fivepipe::baselines {

// The position in a map's tables of the point (x, y, z), in voxels from the grid's corner, is
//   of_x x + of_y y + of_z z + of_1, homogeneous.
struct CarvingCamera {
  std::array<float, 3> of_x, of_y, of_z, of_1;
  LookupTables map;
};

// Cubes of one level of the octree, by their minimum corner in voxels. mixed: the cameras (bit i:
// camera i) whose object pixels do not fill the cube's image; kCarved if a camera has no object
// pixel there.
struct CarvedNodes {
  std::vector<std::int32_t> x, y, z, mixed;
  void clear() {
    for (auto* v : {&x, &y, &z, &mixed}) v->clear();
  }
  void add(int x_voxel, int y_voxel, int z_voxel, std::int32_t mixed_cameras) {
    x.push_back(x_voxel);
    y.push_back(y_voxel);
    z.push_back(z_voxel);
    mixed.push_back(mixed_cameras);
  }
};
inline constexpr std::int32_t kCarved = -1;

// Tests the nodes, of edge size_voxels, against their mixed cameras, and updates `mixed`.
void test_nodes(std::span<const CarvingCamera> cameras, int size_voxels, CarvedNodes& nodes);

// Writes the voxels of a brick, testing the cameras in `mixed`.
void carve_brick(std::span<const CarvingCamera> cameras, const std::array<int, 3>& corner_voxel,
                 std::int32_t mixed, std::uint32_t* words);

// The ray through (u, v) is eye + t * (of_u u + of_v v + of_1) in voxels; t is the depth in m.
struct DrawnView {
  std::array<float, 3> eye, of_u, of_v, of_1;
  float near_m, far_m;
  std::array<std::int32_t, 3> begin_voxel, end_voxel;  // a box that contains all occupied voxels
};
// draw_tile() writes row v of the tile to depth_m + v * stride. All voxels of the tile are between
// begin_m and end_m in depth.
struct DrawnTile {
  hull::PixelRect rays;
  float begin_m, end_m;
  float* depth_m;
  std::size_t stride;
};
void draw_tile(const VoxelGrid& grid, const DrawnView& view, const DrawnTile& tile);

}  // namespace fivepipe::baselines
