#include "recon_node/tiles.h"

#include <cassert>

namespace fivepipe::recon {

std::vector<Tile> tiles_of(int width_px, int height_px, int columns, int rows) {
  assert(width_px >= 0 && height_px >= 0 && columns > 0 && rows > 0);
  std::vector<Tile> tiles;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      tiles.push_back({row * columns + column,
                       {width_px * column / columns, height_px * row / rows,
                        width_px * (column + 1) / columns, height_px * (row + 1) / rows}});
  return tiles;
}

}  // namespace fivepipe::recon
