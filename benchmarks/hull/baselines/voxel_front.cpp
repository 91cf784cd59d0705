#include "benchmarks/hull/baselines/voxel_front.h"

#include <algorithm>
#include <cmath>

namespace fivepipe::baselines {
namespace {

// Bounds on float rounding: of positions in a view of some thousand pixels, and of depths relative
// to the scene's size (eight roundings).
constexpr float kRounding_px = 1.0f / 64, kRounding = 1e-6f;

}  // namespace

VoxelFront::VoxelFront(const VoxelGrid& grid, const hull::View& view)
    : across_((view.camera.pinhole.width_px + kFrontTile_px - 1) / kFrontTile_px),
      down_((view.camera.pinhole.height_px + kFrontTile_px - 1) / kFrontTile_px) {
  const geometry::Pinhole& k = view.camera.pinhole;
  const Eigen::Matrix3d pixel_from_camera = geometry::centered_pixel_from_camera(k);
  const Eigen::Matrix3d m =
      pixel_from_camera * view.camera.camera_from_world.linear() * grid.voxel_m;
  of_x_ = floats(m.col(0));
  of_y_ = floats(m.col(1));
  of_z_ = floats(m.col(2));
  of_1_ = floats(pixel_from_camera * (view.camera.camera_from_world * grid.corner_world_m));
  const double size_m =
      grid.voxel_m * kBrick_voxels * (grid.bricks[0] + grid.bricks[1] + grid.bricks[2]);
  voxel_px_m_ = float(std::max(k.fx_px, k.fy_px) * grid.voxel_m);
  slack_m_ = kRounding * float(size_m + std::abs(of_1_[2]));
}

void VoxelFront::add_brick(const std::array<int, 3>& corner_voxel, const std::uint32_t* words,
                           std::span<TileDepths> depths) const {
  const std::array corner{float(corner_voxel[0]), float(corner_voxel[1]), float(corner_voxel[2])};
  constexpr float kHalf = 0.5f * kBrick_voxels;
  const std::array center{corner[0] + kHalf, corner[1] + kHalf, corner[2] + kHalf};
  if (!words) return add_cube(center, kHalf, depths);
  // Uses blocks of two if blocks of four would span more than a tile.
  const float depth_m =
      of_x_[2] * center[0] + of_y_[2] * center[1] + of_z_[2] * center[2] + of_1_[2];
  const bool fine = kHalf * voxel_px_m_ > kFrontTile_px * depth_m;
  for (int block = 0; block < 64; block += fine ? 1 : 8) {
    const std::uint32_t* word = words + block / 4;
    if (!(fine ? word[0] >> block % 4 * 8 & 0xff : word[0] | word[1])) continue;
    const float half = fine ? 1 : 2;
    const auto at = [&](int axis) {
      return corner[std::size_t(axis)] +
             float((block >> axis & 1) * 2 + (block >> (axis + 3) & 1) * 4) + half;
    };
    add_cube({at(0), at(1), at(2)}, half, depths);
  }
}

void VoxelFront::add_cube(const std::array<float, 3>& center, float half_voxels,
                          std::span<TileDepths> depths) const {
  const auto at = [&](std::size_t k) {
    return of_x_[k] * center[0] + of_y_[k] * center[1] + of_z_[k] * center[2] + of_1_[k];
  };
  const float depth_m = at(2),
              half_m = half_voxels * (std::abs(of_x_[2]) + std::abs(of_y_[2]) + std::abs(of_z_[2]));
  const float begin_m = depth_m - half_m - slack_m_, end_m = depth_m + half_m + slack_m_;
  if (!(end_m > 0)) return;
  int first[2] = {0, 0}, last[2] = {across_ - 1, down_ - 1};
  if (begin_m > 0)
    for (std::size_t k = 0; k < 2; ++k) {
      // A point moved by m moves in the image by (p_k m - position p_w m) / (w + p_w m).
      const float position = at(k) / depth_m;
      const float extent =
          half_voxels *
              (std::abs(of_x_[k] - position * of_x_[2]) + std::abs(of_y_[k] - position * of_y_[2]) +
               std::abs(of_z_[k] - position * of_z_[2])) /
              begin_m +
          kRounding_px;
      const float begin = (position - extent) / kFrontTile_px,
                  end = (position + extent) / kFrontTile_px, count = float(last[k] + 1);
      if (!(begin < count && end >= 0)) return;
      first[k] = begin > 0 ? int(begin) : 0;
      last[k] = end < count ? int(end) : last[k];
    }
  for (int y = first[1]; y <= last[1]; ++y)
    for (int x = first[0]; x <= last[0]; ++x) {
      TileDepths& tile = depths[std::size_t(y * across_ + x)];
      tile.begin_m = std::min(tile.begin_m, begin_m);
      tile.end_m = std::max(tile.end_m, end_m);
    }
}

}  // namespace fivepipe::baselines
