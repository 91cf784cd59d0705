// The occupied voxels, in bricks: the output of the carving and the input of the ray casting.
#pragma once
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

namespace fivepipe::baselines {

inline constexpr int kBrick_voxels = 8;            // along an edge
inline constexpr std::size_t kWordsPerBrick = 16;  // of 32 bits

// A brick's entry in the index: the brick's number in VoxelGrid::voxels, or one of these.
inline constexpr std::int32_t kEmptyBrick = -1, kFullBrick = -2;

// Returns the bit of the voxel with these coordinates (0 to 7) in its brick. Blocks of 4, of 2 and
// voxels are nested, each in the order x, y, z (Morton), so that a block of 2 is one byte, and
// empty blocks can be skipped by byte or word.
constexpr int bit_in_brick(int x, int y, int z) {
  int bit = 0;
  for (int level = 2; level >= 0; --level)
    bit = bit << 3 | (x >> level & 1) | (y >> level & 1) << 1 | (z >> level & 1) << 2;
  return bit;
}

inline std::array<float, 3> floats(const Eigen::Vector3d& p) {
  return {float(p.x()), float(p.y()), float(p.z())};
}

struct VoxelGrid {
  Eigen::Vector3d corner_world_m;  // minimum corner of voxel (0, 0, 0); the axes are the world's
  double voxel_m;
  std::array<int, 3> bricks;  // counts along x, y, z
  int y_shift, z_shift;
  std::vector<std::int32_t> index;    // of brick (x, y, z) at z << z_shift | y << y_shift | x
  std::vector<std::uint32_t> voxels;  // kWordsPerBrick per brick
  std::array<int, 3> begin, end;      // the bricks outside [begin, end) are empty

  std::size_t at(int x, int y, int z) const {
    return std::size_t(z) << z_shift | std::size_t(y) << y_shift | std::size_t(x);
  }

  bool occupied(int x, int y, int z) const {  // false outside
    const auto outside = [](int i, int count) { return i < 0 || i >= count * kBrick_voxels; };
    if (outside(x, bricks[0]) || outside(y, bricks[1]) || outside(z, bricks[2])) return false;
    const std::int32_t brick = index[at(x / kBrick_voxels, y / kBrick_voxels, z / kBrick_voxels)];
    if (brick < 0) return brick == kFullBrick;
    const int bit = bit_in_brick(x % kBrick_voxels, y % kBrick_voxels, z % kBrick_voxels);
    return voxels[std::size_t(brick) * kWordsPerBrick + std::size_t(bit >> 5)] >> (bit & 31) & 1;
  }
};

}  // namespace fivepipe::baselines
