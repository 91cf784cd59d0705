#include "benchmarks/hull/baselines/voxel_carving.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "benchmarks/hull/baselines/tile_range.h"
#include "benchmarks/hull/baselines/voxel_simd.h"
#include "common/hull/map_from_view.h"

namespace fivepipe::baselines {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kRoot_voxels = 64;     // edge of an octree root
constexpr int kBricksPerPiece = 16;  // a unit of work for threads: some microseconds

CarvingCamera lanes_of(const geometry::Camera& camera, const ObjectPixelLookup& lookup,
                       const VoxelGrid& grid) {
  Matrix3d position_from_camera = geometry::pixel_from_camera(camera.pinhole);
  position_from_camera(0, 2) -= lookup.origin_u_px();
  position_from_camera(1, 2) -= lookup.origin_v_px();
  const Matrix3d m = position_from_camera * camera.camera_from_world.linear() * grid.voxel_m;
  return {floats(m.col(0)), floats(m.col(1)), floats(m.col(2)),
          floats(position_from_camera * (camera.camera_from_world * grid.corner_world_m)),
          lookup.tables()};
}

DrawnView lanes_of(const hull::View& view, const VoxelGrid& grid) {
  const geometry::Pinhole& k = view.camera.pinhole;
  const Matrix3d world_from_camera =
      view.camera.camera_from_world.linear().transpose() / grid.voxel_m;
  const Vector3d of_u = world_from_camera.col(0) / k.fx_px,
                 of_v = world_from_camera.col(1) / k.fy_px;
  DrawnView lanes{
      floats((geometry::camera_center_world_m(view.camera) - grid.corner_world_m) / grid.voxel_m),
      floats(of_u),
      floats(of_v),
      floats(world_from_camera.col(2) - k.cx_px * of_u - k.cy_px * of_v),
      float(view.near_m),
      float(view.far_m),
      {},
      {}};
  for (std::size_t i = 0; i < 3; ++i) {
    lanes.begin_voxel[i] = grid.begin[i] * kBrick_voxels;
    lanes.end_voxel[i] = grid.end[i] * kBrick_voxels;
  }
  return lanes;
}

void divide(const CarvedNodes& parents, int size_voxels, const VoxelGrid& grid,
            CarvedNodes& children) {
  children.clear();
  const int half = size_voxels / 2;
  for (std::size_t i = 0; i < parents.x.size(); ++i) {
    if (parents.mixed[i] == kCarved) continue;
    for (int child = 0; child < 8; ++child) {
      const int x = parents.x[i] + (child & 1) * half, y = parents.y[i] + (child >> 1 & 1) * half,
                z = parents.z[i] + (child >> 2) * half;
      if (x < grid.bricks[0] * kBrick_voxels && y < grid.bricks[1] * kBrick_voxels &&
          z < grid.bricks[2] * kBrick_voxels)
        children.add(x, y, z, parents.mixed[i]);
    }
  }
}

// Writes the index. Leaves the bricks to be carved in `nodes`, and moves the full bricks to `full`.
void index_bricks(CarvedNodes& nodes, CarvedNodes& full, VoxelGrid& grid) {
  full.clear();
  std::fill(grid.index.begin(), grid.index.end(), kEmptyBrick);
  grid.begin = grid.bricks;
  grid.end = {0, 0, 0};
  std::size_t mixed = 0;
  for (std::size_t i = 0; i < nodes.x.size(); ++i) {
    if (nodes.mixed[i] == kCarved) continue;
    const std::array brick{nodes.x[i] / kBrick_voxels, nodes.y[i] / kBrick_voxels,
                           nodes.z[i] / kBrick_voxels};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      grid.begin[axis] = std::min(grid.begin[axis], brick[axis]);
      grid.end[axis] = std::max(grid.end[axis], brick[axis] + 1);
    }
    std::int32_t& entry = grid.index[grid.at(brick[0], brick[1], brick[2])];
    if (nodes.mixed[i] == 0) {
      entry = kFullBrick;
      full.add(nodes.x[i], nodes.y[i], nodes.z[i], 0);
      continue;
    }
    entry = std::int32_t(mixed);
    nodes.x[mixed] = nodes.x[i];
    nodes.y[mixed] = nodes.y[i];
    nodes.z[mixed] = nodes.z[i];
    nodes.mixed[mixed++] = nodes.mixed[i];
  }
  for (auto* v : {&nodes.x, &nodes.y, &nodes.z, &nodes.mixed}) v->resize(mixed);
}

}  // namespace

VoxelCarving::VoxelCarving(const Eigen::AlignedBox3d& volume_world_m, double voxel_m) {
  grid_.corner_world_m = volume_world_m.min();
  grid_.voxel_m = voxel_m;
  double along[3];
  for (int i = 0; i < 3; ++i)
    along[i] = std::ceil(volume_world_m.sizes()[i] / (voxel_m * kBrick_voxels));
  if (!(voxel_m > 0 && along[0] > 0 && along[1] > 0 && along[2] > 0 &&
        along[0] * along[1] * along[2] <= double(kMaxBricks)) ||
      volume_world_m.isEmpty())
    throw std::invalid_argument("voxel carving: volume or voxel size");
  for (std::size_t i = 0; i < 3; ++i) grid_.bricks[i] = int(along[i]);
  grid_.y_shift = std::bit_width(unsigned(grid_.bricks[0] - 1));
  grid_.z_shift = grid_.y_shift + std::bit_width(unsigned(grid_.bricks[1] - 1));
  grid_.index.assign(std::size_t(grid_.bricks[2]) << grid_.z_shift, kEmptyBrick);
  grid_.begin = grid_.end = {0, 0, 0};
}

bool VoxelCarving::carve(std::span<const hull::Silhouette> silhouettes, base::WorkerPool& pool) {
  if (silhouettes.size() > kMaxCarvingCameras)
    throw std::invalid_argument("voxel carving: at most " + std::to_string(kMaxCarvingCameras) +
                                " cameras");
  if (silhouettes.empty() ||
      !std::all_of(silhouettes.begin(), silhouettes.end(),
                   [](const hull::Silhouette& s) { return hull::is_finite(s.camera); }))
    return false;
  cameras_.resize(silhouettes.size());
  pool.run(int(silhouettes.size()), [&](int i, int) {
    MapCamera& c = cameras_[std::size_t(i)];
    c.bounds = silhouettes[std::size_t(i)].pixels.bounds();
    if (!c.bounds.empty()) c.lookup.build(silhouettes[std::size_t(i)].pixels, c.bounds);
  });
  // The smallest silhouette comes first, because it carves the most.
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    if (cameras_[i].bounds.empty()) return false;
    order.push_back(i);
  }
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return cameras_[a].bounds.area_px() < cameras_[b].bounds.area_px();
  });
  std::vector<CarvingCamera> lanes;
  for (const std::size_t i : order)
    lanes.push_back(lanes_of(silhouettes[i].camera, cameras_[i].lookup, grid_));

  nodes_.clear();
  for (int z = 0; z < grid_.bricks[2] * kBrick_voxels; z += kRoot_voxels)
    for (int y = 0; y < grid_.bricks[1] * kBrick_voxels; y += kRoot_voxels)
      for (int x = 0; x < grid_.bricks[0] * kBrick_voxels; x += kRoot_voxels)
        nodes_.add(x, y, z, std::int32_t((1u << lanes.size()) - 1));
  test_nodes(lanes, kRoot_voxels, nodes_);
  for (int size = kRoot_voxels; size > kBrick_voxels; size /= 2) {
    divide(nodes_, size, grid_, children_);
    std::swap(nodes_, children_);
    test_nodes(lanes, size / 2, nodes_);
  }
  index_bricks(nodes_, full_, grid_);
  grid_.voxels.resize(
      (nodes_.x.size() + 1) *
      kWordsPerBrick);  // one more, because lanes without voxels read the first brick
  const int bricks = int(nodes_.x.size());
  pool.run((bricks + kBricksPerPiece - 1) / kBricksPerPiece, [&](int piece, int) {
    for (int b = piece * kBricksPerPiece; b < std::min(bricks, (piece + 1) * kBricksPerPiece);
         ++b) {
      const auto i = std::size_t(b);
      carve_brick(lanes, {nodes_.x[i], nodes_.y[i], nodes_.z[i]}, nodes_.mixed[i],
                  grid_.voxels.data() + i * kWordsPerBrick);
    }
  });
  return true;
}

void VoxelCarving::depth(std::span<const hull::Silhouette> silhouettes, const hull::View& view,
                         base::WorkerPool& pool, std::span<float> depth_m) {
  const hull::PixelRect image{0, 0, view.camera.pinhole.width_px, view.camera.pinhole.height_px};
  assert(depth_m.size() == image.area_px());
  if (!carve(silhouettes, pool)) {
    std::fill(grid_.index.begin(), grid_.index.end(), kEmptyBrick);
    return std::fill(depth_m.begin(), depth_m.end(), hull::kNoHull);
  }
  if (!hull::is_finite(view.camera) || !(view.near_m > 0 && view.far_m > view.near_m))
    return std::fill(depth_m.begin(), depth_m.end(), hull::kNoHull);
  find_front(view, pool);
  const DrawnView lanes = lanes_of(view, grid_);
  const auto stride = std::size_t(image.width_px());
  pool.run(pieces_of(image), [&](int p, int) {
    const hull::PixelRect piece = piece_of(image, p);
    for (int v = piece.v0_px; v < piece.v1_px; ++v)
      std::fill_n(depth_m.data() + std::size_t(v) * stride + piece.u0_px, piece.width_px(),
                  hull::kNoHull);
    for (int v = piece.v0_px; v < piece.v1_px; v += kFrontTile_px)
      for (int u = piece.u0_px; u < piece.u1_px; u += kFrontTile_px) {
        const hull::PixelRect rays =
            hull::intersection(piece, {u, v, u + kFrontTile_px, v + kFrontTile_px});
        const TileDepths depths =
            front_[std::size_t((v / kFrontTile_px) * front_across_ + u / kFrontTile_px)];
        if (depths.begin_m < depths.end_m)
          draw_tile(grid_, lanes,
                    {rays, depths.begin_m, depths.end_m,
                     depth_m.data() + std::size_t(v) * stride + u, stride});
      }
  });
}

// Each thread collects into its own tiles. Minimum and maximum do not depend on how the bricks are
// assigned to threads.
void VoxelCarving::find_front(const hull::View& view, base::WorkerPool& pool) {
  const VoxelFront front(grid_, view);
  front_across_ = front.across();
  const auto tiles = std::size_t(front.across()) * std::size_t(front.down());
  constexpr TileDepths kNone{std::numeric_limits<float>::max(),
                             std::numeric_limits<float>::lowest()};
  front_.assign(tiles * std::size_t(pool.threads()), kNone);
  const int carved = int(nodes_.x.size()), bricks = carved + int(full_.x.size());
  pool.run((bricks + kBricksPerPiece - 1) / kBricksPerPiece, [&](int piece, int thread) {
    const std::span<TileDepths> own(front_.data() + std::size_t(thread) * tiles, tiles);
    for (int b = piece * kBricksPerPiece; b < std::min(bricks, (piece + 1) * kBricksPerPiece);
         ++b) {
      const bool full = b >= carved;
      const auto i = std::size_t(full ? b - carved : b);
      const CarvedNodes& nodes = full ? full_ : nodes_;
      front.add_brick({nodes.x[i], nodes.y[i], nodes.z[i]},
                      full ? nullptr : grid_.voxels.data() + i * kWordsPerBrick, own);
    }
  });
  for (std::size_t i = tiles; i < front_.size(); ++i) {
    TileDepths& all = front_[i % tiles];
    all.begin_m = std::min(all.begin_m, front_[i].begin_m);
    all.end_m = std::max(all.end_m, front_[i].end_m);
  }
}

}  // namespace fivepipe::baselines
