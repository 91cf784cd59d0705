// Buffer layouts and sizes that backend `gl` (gl_hull.h) shares with its compute shaders (*.comp).
#pragma once
#include <cstdint>

namespace fivepipe::hull::gl_hull {

inline constexpr int kMaxCameras =
    64;                             // a view's block stays within the 16 KB that every driver has
inline constexpr int kTile_px = 8;  // a workgroup's rays: tiles of 8x8, aligned in the view
inline constexpr int kGroup =
    64;  // invocations of a workgroup in the passes that are not over rays
inline constexpr int kPad_px = 8;  // free of object pixels around a map's bounds, at least
inline constexpr int kStripWidth_px = 16,
                     kStripHeight_px = 8;  // pixels whose distances one invocation makes
inline constexpr int kCell_px = 8;         // side of a coarse cell

// std430 layouts, as the shaders declare them.
struct Grid {  // bits of one map's crop, or of its coarse cells: a row is whole words of 32, 4
               // words of distances for each
  std::uint32_t first_word, words_per_row, rows, unused;
};
struct Strips {  // an indirect dispatch, and the pairs of words that it works on
  std::uint32_t groups[3], count;
};
struct ViewMap {  // std140
  double eye[4], column[4], row[4],
      constant[4];  // (U, V, W) at the eye; at infinity, by view column, by view row, constant
  std::int32_t bounds[4];            // u0, v0, u1, v1 of the object pixels [px of the crop]
  std::int32_t pixels[4], cells[4];  // distances: first word, words per row, rows, columns
  std::int32_t unused[4];
};
struct ViewBlock {
  double range_m[4];  // near, far
  ViewMap maps[kMaxCameras];
};
struct Candidate {  // a tile to look at: its rays (first to last, inclusive) that are asked for
  std::uint32_t corner, rays;
};
struct Tile {
  double begin_m;  // depth that all rays of the tile start from: none meets the hull before it
  float length_m;  // none after begin + length
  std::uint32_t at_near, corner, rays;
  std::uint32_t unused[2];
};
struct Work {  // two indirect dispatches and what they work on
  std::uint32_t tile_groups[3], tiles, ray_groups[3], rays;
};

}  // namespace fivepipe::hull::gl_hull
