// Blocks of rays traced in vector lanes, in float with certified margins; what margins can't decide
// is left to double.
//
// A block's rays start together. Tiles of 8x8 rays first, then of 4x4: while the images of a tile's
// four corner rays lie in one box of pixels that are all alike, so do those of all its rays. Then
// ray by ray: a camera that sees the ray outside its object moves the ray on to where its image
// leaves the empty box around it, and is asked again until it agrees; one that agrees is not asked
// again before the ray's image may leave the object. Sources: the design's "Rays"; sphere tracing
// (Hart, 1996) with boxes for balls.
//
// Certified: the image's position is known to eps. A box is left over the border that is crossed,
// to a pixel that is known by its number; a position nearer to another border than its error, where
// the pixel behind that may differ, makes the ray uncertain. So do too many steps. Where a box
// tells how long a verdict holds, it is taken smaller by more than the error.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "common/hull/cpu/skip_map.h"
#include "common/hull/map_from_view.h"

namespace fivepipe::hull {

inline constexpr int kBlock_px = 32, kTile_px = 8, kSmallTile_px = 4;
inline constexpr int kMaxSimdCameras = 64;
// Positions less certain than this are for double [px].
inline constexpr double kMaxEps_px = 1.0 / 64;
inline constexpr float kBoxMargin_px = 1.0f / 16;
// A block over which a camera's depth W changes more than so many times is for double.
inline constexpr float kMaxDepthRatio = 64;

// One camera as the rays of a block see it. (U, V, W) of ray (i, j) at depth begin + s [m]:
// at_begin + i du_begin + j dv_begin + s (slope
// + i du + j dv); U / W and V / W are pixels [px], a pixel's centre at the whole number. They count
// from `origin`, so that numbers stay small, and where all images move left, or up, along the
// mirrored axis: pixel p is then -p - 1, and all move right and down.
struct BlockCamera {
  float at_begin[3], du_begin[3], dv_begin[3], slope[3], du[3], dv[3];
  float min_u, max_u, min_v, max_v;  // pixels in store, from the origin
  float step_u, step_v;              // from a pixel to the next, in bytes
  float eps_px, eps_px_per_m;        // a position's error: eps_px + s eps_px_per_m
  const std::int8_t*
      at_origin;  // of the box ahead; where images move both ways, of that to the right and down
  bool both_ways;
  std::int32_t box_bytes;
  int origin_u_px, origin_v_px, sign_u,
      sign_v;  // pixel p of the map is origin + sign * p, and less 1 where sign is -1
  const MapFromView* exact;
};

struct Block {
  PixelRect rays;       // of the view, at most kBlock_px squared
  double begin, end;    // no ray of the block meets the hull before or after
  bool begins_at_near;  // begin is the view's near plane: the hull may be there already
  double near, far;
  std::vector<BlockCamera> cameras;
};

// Set by prepare for the block's present begin. False where float lanes are no use: a camera's
// position is too uncertain.
bool prepare(Block& block, std::span<const MapFromView> maps,
             std::span<const SkipMap* const> skip_maps);

inline constexpr int kRays = kBlock_px * kBlock_px,
                     kMaxTiles = kRays / (kSmallTile_px * kSmallTile_px);

// Tiles of one size, by the number of a tile.
struct TileSet {
  int count;
  alignas(64) float center_i[kMaxTiles], center_j[kMaxTiles];  // in the block
  alignas(64) float s[kMaxTiles];  // where the tile's rays go on, from the block's begin
  alignas(64) float hold[kMaxSimdCameras]
                        [kMaxTiles];  // until when a camera sees all of them on its object
  alignas(64) float asked_at[kMaxSimdCameras][kMaxTiles];  // s at which a camera was asked last
  int stopped[kMaxSimdCameras];  // how often a camera could not move a tile on that starts before
                                 // its object
};
struct SimdScratch {  // of one thread
  TileSet tiles, small_tiles;
  // Ray by ray: 16 for each small tile, row by row.
  alignas(64) float hold[kMaxSimdCameras][kRays];
  alignas(64) float s[kRays], s_error[kRays], border[kRays];
  alignas(64) std::int32_t crossed[kRays];
};

// Writes the depth [m] of each ray, kNoHull where it misses, row by row, pitch floats apart.
// Returns how many rays are uncertain; their numbers, row * kBlock_px + column, are in `uncertain`,
// of kRays, and their depth is to be found otherwise. Moves the block's begin.
int trace_block(Block& block, std::span<const MapFromView> maps,
                std::span<const SkipMap* const> skip_maps, SimdScratch& scratch, float* depth_m,
                std::ptrdiff_t pitch, std::uint16_t* uncertain);

}  // namespace fivepipe::hull
