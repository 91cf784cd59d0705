#include "recon_node/tiles.h"

#include <cassert>

namespace fivepipe {

std::vector<Tile> owned_tiles(int width_px, int height_px, int columns, int rows, int share, int shares) {
  assert(width_px >= 0 && height_px >= 0 && columns > 0 && rows > 0 && shares > 0 && share >= 0 && share < shares);
  std::vector<Tile> tiles;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      if ((column + row) % shares == share)
        tiles.push_back({row * columns + column, {width_px * column / columns, height_px * row / rows, width_px * (column + 1) / columns, height_px * (row + 1) / rows}});
  return tiles;
}

std::vector<Tile> tiles_of(int width_px, int height_px, int columns, int rows) { return owned_tiles(width_px, height_px, columns, rows, 0, 1); }

}  // namespace fivepipe
