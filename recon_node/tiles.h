// Divides a view into tiles, which the reconstruction nodes share.
#pragma once
#include <vector>

#include "common/hull/object_pixels.h"

namespace fivepipe::recon {

struct Tile {
  int index;  // row * columns + column
  hull::PixelRect rect;
  bool operator==(const Tile&) const = default;
};

// Returns columns x rows disjoint tiles that cover the image, row by row. Their sizes differ by at
// most one pixel; some are empty if there are more columns or rows than pixels. Requires sizes >=
// 0, columns and rows > 0.
std::vector<Tile> tiles_of(int width_px, int height_px, int columns, int rows);

}  // namespace fivepipe::recon
