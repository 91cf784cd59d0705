// SIMD ray tracing of blocks of rays, in float with certified error bounds. The caller traces the
// rays that the bounds leave uncertain in double.
//
// The method is sphere tracing (Hart, 1996) with boxes in the images in place of balls. All rays of
// a block start at one depth. Tiles of 8x8 rays are moved on first, then tiles of 4x4: while the
// images of a tile's four corner rays are in one uniform box of pixels, the images of all its rays
// are. Then each ray is traced: a camera that sees the ray outside its object moves the ray on to
// where its image leaves the empty box around it, and is tested again until it agrees, which means
// that it sees the ray on its object. A camera that agrees is not tested again before the ray's
// image may leave the object.
//
// Error bounds: the position of an image is known to eps. When a ray leaves a box, it enters a
// pixel whose index is known from the border crossed. A ray becomes uncertain if its position is
// within its error of another border beyond which the verdict may differ, or if it takes too many
// steps. The span of a verdict is shortened by more than the error.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "common/hull/cpu/skip_map.h"
#include "common/hull/map_from_view.h"

namespace fivepipe::hull {

inline constexpr int kBlock_px = 32, kTile_px = 8, kSmallTile_px = 4;
inline constexpr int kMaxSimdCameras = 64;
// Rays whose positions have a larger error bound than this are traced in double [px].
inline constexpr double kMaxEps_px = 1.0 / 64;
// Positions keep this distance from a box's border; it is larger than the error of the positions.
inline constexpr float kBoxMargin_px = 1.0f / 16;
// Blocks over which a camera's depth W changes by more than this factor are traced in double.
inline constexpr float kMaxDepthRatio = 64;

// Projection of a block's rays into one camera. Ray (i, j) at depth begin + s [m] has
//   (U, V, W) = at_begin + i du_begin + j dv_begin + s (slope + i du + j dv).
// U / W and V / W are pixel coordinates [px] relative to `origin`, so that numbers stay small.
// Pixel centres are at integers. If all images move left, or up, that axis is mirrored (pixel p
// becomes -p - 1), so that all images move right and down.
struct BlockCamera {
  float at_begin[3], du_begin[3], dv_begin[3], slope[3], du[3], dv[3];
  float min_u, max_u, min_v, max_v;  // stored pixels, relative to the origin
  float step_u, step_v;              // distance between adjacent pixels [bytes]
  float eps_px, eps_px_per_m;        // bound of a position's error: eps_px + s eps_px_per_m
  // The origin's byte of the quadrant ahead; if both_ways, of Quadrant::right_down.
  const std::int8_t* at_origin;
  bool both_ways;  // the images do not all move in one direction along each axis
  std::int32_t box_bytes;
  // Pixel p here is pixel origin + p of the map if sign is 1, origin - p - 1 if it is -1.
  int origin_u_px, origin_v_px, sign_u, sign_v;
  const MapFromView* exact;
};

struct Block {
  PixelRect rays;       // pixels of the view, at most kBlock_px x kBlock_px
  double begin, end;    // depths [m]; no ray of the block meets the hull before or after
  bool begins_at_near;  // begin is the near plane, where a ray may already be in the hull
  double near, far;     // of the view [m]
  std::vector<BlockCamera> cameras;
};

// Computes block.cameras for the block's current begin. Returns false if the block must be traced
// in double, because the error bound of a camera is too large or a quadrant is missing or too
// large.
bool prepare(Block& block, std::span<const MapFromView> maps,
             std::span<const SkipMap* const> skip_maps);

inline constexpr int kRays = kBlock_px * kBlock_px,
                     kMaxTiles = kRays / (kSmallTile_px * kSmallTile_px);

// Tiles of one size. Arrays are indexed by tile.
struct TileSet {
  int count;
  alignas(64) float center_i[kMaxTiles], center_j[kMaxTiles];  // in the block
  alignas(64) float s[kMaxTiles];  // common position of the tile's rays, from the block's begin [m]
  // s up to which a camera sees all rays of the tile on its object.
  alignas(64) float hold[kMaxSimdCameras][kMaxTiles];
  alignas(64) float tested_at[kMaxSimdCameras][kMaxTiles];  // s of a camera's last test
  // Number of tests in which a camera saw a tile off its object but could not move it on.
  int stopped[kMaxSimdCameras];
};
struct SimdScratch {  // one per thread
  TileSet tiles, small_tiles;
  // Per ray: 16 rays for each small tile, row-major. s and hold are as in TileSet. `crossed` is 2 *
  // camera + axis of the border that the ray crossed last, or -1; `border` is its position relative
  // to BlockCamera's origin [px].
  alignas(64) float hold[kMaxSimdCameras][kRays];
  alignas(64) float s[kRays], s_error[kRays], border[kRays];
  alignas(64) std::int32_t crossed[kRays];
};

// Writes the depth [m] of each ray, or kNoHull if it misses the hull. Rows are `pitch` floats
// apart. Returns the number of uncertain rays and writes their indices, row * kBlock_px + column,
// to `uncertain`, which has room for kRays. The caller must trace those in double. May increase
// block.begin.
int trace_block(Block& block, std::span<const MapFromView> maps,
                std::span<const SkipMap* const> skip_maps, SimdScratch& scratch, float* depth_m,
                std::ptrdiff_t pitch, std::uint16_t* uncertain);

}  // namespace fivepipe::hull
