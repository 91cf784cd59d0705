// Buffer layouts and sizes that backend `gl` (gl_hull.h) shares with its compute shaders (*.comp).
#pragma once
#include <cstdint>

namespace fivepipe::hull::gl_hull {

inline constexpr int kMaxCameras = 64;  // ViewBlock fits into 16 KiB, which every driver supports
inline constexpr int kTile_px = 8;  // a workgroup traces a tile of 8x8 rays, aligned in the view
inline constexpr int kGroup = 64;   // invocations per workgroup of the other passes
inline constexpr int kPad_px = 8;   // minimum of empty pixels around a map's bounds
// One invocation of distances.comp computes a strip of this size.
inline constexpr int kStripWidth_px = 16, kStripHeight_px = 8;
inline constexpr int kCell_px = 8;  // side of a coarse cell

// std430 layouts, as the shaders declare them.
// Bits of one map's crop or of its coarse cells. A row is whole words of 32 bits; each has 4 words
// of distances.
struct Grid {
  std::uint32_t first_word, words_per_row, rows, unused;
};
struct Strips {  // an indirect dispatch; the list of strips follows
  std::uint32_t groups[3], count;
};
struct ViewMap {  // std140
  // (U, V, W) of the view's eye; then the slope per view column, per view row, and constant
  // (MapFromView::at_infinity).
  double eye[4], column[4], row[4], constant[4];
  std::int32_t bounds[4];            // u0, v0, u1, v1 of the object pixels, in the crop [px]
  std::int32_t pixels[4], cells[4];  // distances: first word, words per row, rows, columns
  std::int32_t image[4];             // u0, v0, u1, v1 of the image, in the crop [px]
};
struct ViewBlock {
  double range_m[4];  // near, far; [2]: HullRule::min_seen with Limits::seen
  // The point at depth t [m] on the ray through (u, v) is eye_m + t (u column + v row + constant)
  // [world].
  double eye_m[4], column[4], row[4], constant[4];
  double box_min_m[4], box_max_m[4];  // HullRule::within_world_m
  ViewMap maps[kMaxCameras];
};
// A tile: its first pixel (u, v << 16) and the requested rays, first to last inclusive, as 4 bits
// each of first u, last u, first v, last v.
struct Candidate {
  std::uint32_t corner, rays;
};
struct Tile {
  double begin_m;         // common start of the tile's rays; no ray meets the hull before it
  float length_m;         // no ray meets the hull after begin_m + length_m
  std::uint32_t at_near;  // 1: begin_m is the near plane, where a ray may already be in the hull
  std::uint32_t corner, rays;  // as Candidate
  std::uint32_t leaves_box;    // 1: a ray of the tile may be outside the rule's box in the range
  std::uint32_t unused;
};
struct Work {  // two indirect dispatches; the list of uncertain rays follows
  std::uint32_t tile_groups[3], tiles, ray_groups[3], rays;
};

}  // namespace fivepipe::hull::gl_hull
