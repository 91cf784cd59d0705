#include "benchmarks/hull/baselines/object_pixel_lookup.h"

#include <algorithm>

namespace fivepipe::baselines {
namespace {

constexpr int kBorder_u_px = 32, kBorder_v_px = kCell_px;  // a word of bits; a cell
constexpr std::uint64_t kFirstOfCells = 0x1111111111111111;

}  // namespace

void ObjectPixelLookup::build(const hull::ObjectPixels& pixels, const hull::PixelRect& bounds) {
  const int first_word = bounds.u0_px >> 6, words = ((bounds.u1_px - 1) >> 6) - first_word + 1;
  const int cell_rows = (bounds.height_px() + kCell_px - 1) / kCell_px;
  origin_u_px_ = first_word * 64 - kBorder_u_px;
  origin_v_px_ = bounds.v0_px - kBorder_v_px;
  width_px_ = words * 64 + 2 * kBorder_u_px;
  height_px_ = cell_rows * kCell_px + 2 * kBorder_v_px;
  const auto bits_stride = std::size_t(width_px_) / 32, columns = std::size_t(width_px_) / kCell_px,
             stride = columns + 1;
  bits_.assign(bits_stride * std::size_t(height_px_), 0);
  cells_.assign(stride * (std::size_t(height_px_) / kCell_px + 1), 0);

  for (int row = 0; row < cell_rows; ++row) {
    const std::uint32_t* above =
        cells_.data() + std::size_t(row + 1) * stride + kBorder_u_px / kCell_px;
    std::uint32_t* sums = cells_.data() + std::size_t(row + 2) * stride + kBorder_u_px / kCell_px;
    std::uint32_t sum = 0;
    const int v0 = bounds.v0_px + row * kCell_px;
    for (int w = 0; w < words; ++w) {
      std::uint64_t any = 0, all = ~std::uint64_t(0);
      for (int v = v0; v < v0 + kCell_px; ++v) {
        const std::uint64_t word =
            v < bounds.v1_px
                ? pixels.words()[std::size_t(v) * pixels.words_per_row() + first_word + w]
                : 0;
        std::uint32_t* bits =
            bits_.data() + std::size_t(v - origin_v_px_) * bits_stride + kBorder_u_px / 32 + 2 * w;
        bits[0] = std::uint32_t(word);
        bits[1] = std::uint32_t(word >> 32);
        any |= word;
        all &= word;
      }
      any |= any >> 1;
      all &= all >> 1;
      any = (any | any >> 2) & kFirstOfCells;
      all = (all & all >> 2) & kFirstOfCells;
      for (int cell = 1; cell <= 64 / kCell_px; ++cell, any >>= kCell_px, all >>= kCell_px) {
        sum += std::uint32_t(any & 1) | std::uint32_t(all & 1) << 16;
        sums[16 * w + cell] = above[16 * w + cell] + sum;
      }
    }
    const int end = 64 / kCell_px * words;
    std::fill_n(sums + end + 1, kBorder_u_px / kCell_px, sums[end]);
  }
  const auto last = std::size_t(cell_rows + 1) * stride;  // the border below adds nothing
  std::copy_n(cells_.data() + last, stride, cells_.data() + last + stride);
}

}  // namespace fivepipe::baselines
