// What the plane sweep and the carving look up in a map: single object pixels, and how many cells
// of a rectangle hold any, or nothing else. Source of the counts: Crow, "Summed-Area Tables for
// Texture Mapping", SIGGRAPH 1984; over cells of 4x4 pixels, so that a table takes a map's reading
// to build and stays in the second cache level.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "common/hull/object_pixels.h"

namespace fivepipe::baselines {

inline constexpr int kCell_px = 4;

// Positions (x, y) are pixels from a corner that leaves an empty border around the object pixels:
// positions held to [0, width_px) x [0, height_px) find nothing outside.
struct LookupTables {
  const std::uint32_t* bits;   // bit x & 31 of word y * words_per_row + x / 32
  const std::uint32_t* cells;  // at (column, row) of (columns + 1) x (rows + 1): sums over the
                               // cells above and to the left: those with any object pixel in the
                               // lower 16 bits, those of object pixels alone in the upper
  int width_px, height_px, words_per_row, columns;
};

class ObjectPixelLookup {
 public:
  // bounds: of the pixels, not empty. Keeps its buffers.
  void build(const hull::ObjectPixels& pixels, const hull::PixelRect& bounds);
  // Pixel of the map at position (0, 0).
  int origin_u_px() const { return origin_u_px_; }
  int origin_v_px() const { return origin_v_px_; }
  LookupTables tables() const {
    return {bits_.data(), cells_.data(),  width_px_,
            height_px_,   width_px_ / 32, width_px_ / kCell_px};
  }

 private:
  int origin_u_px_ = 0, origin_v_px_ = 0, width_px_ = 0, height_px_ = 0;
  std::vector<std::uint32_t> bits_, cells_;
};

// Sums wrap beyond this many cells (a rectangle of 1024x1024 pixels): such rectangles count as
// neither empty nor full.
inline constexpr int kMaxCells = 0xffff;

}  // namespace fivepipe::baselines
