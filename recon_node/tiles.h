// The view is cut into tiles, which the reconstruction nodes share.
#pragma once
#include <vector>

#include "common/hull/object_pixels.h"

namespace fivepipe::recon {

struct Tile {
  int index;  // row * columns + column
  hull::PixelRect rect;
  bool operator==(const Tile&) const = default;
};

// columns x rows tiles of an image, of sizes that differ by a pixel at most, row by row. Disjoint,
// they cover the image; tiles are empty where there are more of them than pixels. Sizes >= 0,
// columns and rows > 0.
std::vector<Tile> tiles_of(int width_px, int height_px, int columns, int rows);

}  // namespace fivepipe::recon
