// The tables that the plane sweep and the carving read: single object pixels, and how many cells of
// a rectangle hold at least one object pixel, or only object pixels. Source of the counts: Crow,
// "Summed-Area Tables for Texture Mapping", SIGGRAPH 1984. A cell is 4x4 pixels, so that building a
// table costs as much as reading the map, and the table fits the second-level cache.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "common/hull/object_pixels.h"

namespace fivepipe::baselines {

inline constexpr int kCell_px = 4;

// Positions (x, y) are in pixels from a corner that leaves an empty border around the object
// pixels, so a position clamped to [0, width_px) x [0, height_px) reads no object pixel there.
struct LookupTables {
  const std::uint32_t* bits;  // bit x & 31 of word y * words_per_row + x / 32
  // Entry (column, row) of (columns + 1) x (rows + 1) counts the cells above and to the left. Low
  // 16 bits: cells with any object pixel; high 16 bits: cells with only object pixels.
  const std::uint32_t* cells;
  int width_px, height_px, words_per_row, columns;
};

class ObjectPixelLookup {
 public:
  // `bounds` are those of the object pixels and not empty. Keeps its buffers.
  void build(const hull::ObjectPixels& pixels, const hull::PixelRect& bounds);
  // The map's pixel at position (0, 0).
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

// Counts wrap at more cells (a rectangle of 1024x1024 pixels); such rectangles count as neither
// empty nor full.
inline constexpr int kMaxCells = 0xffff;

}  // namespace fivepipe::baselines
