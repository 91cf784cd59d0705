#include "common/hull/empty_space.h"

#include <algorithm>

namespace fivepipe {
namespace {

// Chessboard distances in place, from 0 where something is and 255 elsewhere: two passes (Rosenfeld and Pfaltz, 1966).
void spread_distances(std::vector<std::uint8_t>& distances, int columns, int rows) {
  const auto relax = [&](int column, int row, int from_column, int from_row) {
    if (from_column < 0 || from_row < 0 || from_column >= columns || from_row >= rows) return;
    std::uint8_t& d = distances[std::size_t(row) * columns + column];
    d = std::uint8_t(std::min<int>(d, distances[std::size_t(from_row) * columns + from_column] + 1));
  };
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      relax(column, row, column - 1, row);
      for (int du = -1; du <= 1; ++du) relax(column, row, column + du, row - 1);
    }
  for (int row = rows - 1; row >= 0; --row)
    for (int column = columns - 1; column >= 0; --column) {
      relax(column, row, column + 1, row);
      for (int du = -1; du <= 1; ++du) relax(column, row, column + du, row + 1);
    }
}

}  // namespace

EmptySpace::EmptySpace(const ObjectPixels& pixels) : bounds_(pixels.bounds()) {
  if (bounds_.empty()) return;
  u0_px_ = bounds_.u0_px & ~7;
  v0_px_ = bounds_.v0_px;
  columns_ = (bounds_.u1_px - u0_px_ + 7) / 8;
  rows_ = (bounds_.height_px() + 7) / 8;
  cells_.resize(std::size_t(columns_) * rows_);
  for (int v = bounds_.v0_px; v < bounds_.v1_px; ++v) {
    const int row = (v - v0_px_) >> 3, shift = 8 * ((v - v0_px_) & 7);
    for (int column = 0; column < columns_; ++column) {
      const int u = u0_px_ + 8 * column;
      const std::uint64_t byte = pixels.words()[std::size_t(v) * pixels.words_per_row() + u / 64] >> (u % 64) & 0xff;
      cells_[std::size_t(row) * columns_ + column] |= byte << shift;
    }
  }
  distances_.resize(cells_.size());
  std::transform(cells_.begin(), cells_.end(), distances_.begin(), [](std::uint64_t bits) { return std::uint8_t(bits ? 0 : 255); });
  spread_distances(distances_, columns_, rows_);
}

}  // namespace fivepipe
