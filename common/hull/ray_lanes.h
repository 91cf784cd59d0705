// Blocks of rays traced in vector lanes, in float with certified margins; what margins can't decide is left to double.
//
// A block's rays start together. Tiles of 8x8 rays first: while the images of a tile's four corner rays lie in one box of pixels
// that are all alike, so do those of all its rays. Then ray by ray: a camera that sees the ray outside its object moves the ray
// on to where its image leaves the empty box around it, and is asked again until it agrees; one that agrees is not asked again
// before the ray's image may leave the object. Sources: the design's "Rays"; sphere tracing (Hart, 1996) with boxes for balls.
//
// Certified: the image's position is known to eps_px. A box of half-width > 1 pixel is taken smaller by kBoxMargin_px, far more than
// eps; a single pixel is left by the border that is crossed, and a position nearer to a border than its error, where the pixel
// behind it may differ, makes the ray unsettled. So is one that takes too many steps.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "common/hull/border_distance.h"
#include "common/hull/map_from_view.h"

namespace fivepipe {

inline constexpr int kBlock_px = 32, kTile_px = 8;
inline constexpr int kMaxLaneCameras = 64;
// Positions less certain than this are for double [px].
inline constexpr double kMostEps_px = 1.0 / 64;
inline constexpr float kBoxMargin_px = 1.0f / 16;

// One camera as the rays of a block see it. (U, V, W) of ray (i, j) at begin + s: at_begin + i du_begin + j dv_begin + s (slope + i du +
// j dv); pixels count from `origin`, so that numbers stay small.
struct BlockCamera {
  float at_begin[3], du_begin[3], dv_begin[3], slope[3], du[3], dv[3];
  float least_u, most_u, least_v, most_v;  // pixels in store, from the origin
  float stride, eps_px;
  const std::int8_t* at_origin;
  int origin_u_px, origin_v_px;  // in the map
  const MapFromView* exact;
};

struct Block {
  PixelRect rays;              // of the view, at most kBlock_px squared
  double begin, end;           // no ray of the block meets the hull before or after
  bool begins_at_near;         // begin is the view's near plane: the hull may be there already
  double near, far;
  std::vector<BlockCamera> cameras;
};

// False where float lanes are no use: a camera's position is too uncertain.
bool prepare(Block& block, std::span<const MapFromView> maps, std::span<const BorderDistance* const> borders);

struct LaneScratch {
  alignas(64) float tile_hold[kMaxLaneCameras][16];
  alignas(64) float hold[kMaxLaneCameras][64];
};

// Writes the depth [m] of each ray, kNoHull where it misses, row by row, pitch floats apart. Returns how many rays are unsettled; their
// numbers, row * kBlock_px + column, are in `unsettled`, of kBlock_px squared, and their depth is to be found otherwise.
int trace_block(const Block& block, LaneScratch& scratch, float* depth_m, std::ptrdiff_t pitch, std::uint16_t* unsettled);

}  // namespace fivepipe
