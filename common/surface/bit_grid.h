// One bit for each point or cell of a box-shaped lattice, and the places where they differ.
#pragma once
#include <Eigen/Core>
#include <atomic>
#include <bit>
#include <cstdint>
#include <vector>

namespace fivepipe::surface {

// x varies fastest. Each row is padded to whole words, with zeros.
class BitGrid {
 public:
  static constexpr int kWordBits = 64;
  explicit BitGrid(const Eigen::Vector3i& size)
      : size_(size),
        words_per_row_((size.x() + kWordBits - 1) / kWordBits),
        words_(std::size_t(words_per_row_) * std::size_t(size.y()) * std::size_t(size.z()), 0) {}

  const Eigen::Vector3i& size() const { return size_; }
  int words_per_row() const { return words_per_row_; }
  const std::uint64_t* row(int y, int z) const { return &words_[first_word(y, z)]; }
  bool at(int x, int y, int z) const { return row(y, z)[x / kWordBits] >> (x % kWordBits) & 1; }
  void set(int x, int y, int z) { word_of(x, y, z) |= bit_of(x); }
  // Several threads may call it at once, also together with at_shared().
  void set_shared(int x, int y, int z) {
    std::atomic_ref(word_of(x, y, z)).fetch_or(bit_of(x), std::memory_order_relaxed);
  }
  bool at_shared(int x, int y, int z) {
    return (std::atomic_ref(word_of(x, y, z)).load(std::memory_order_relaxed) & bit_of(x)) != 0;
  }
  std::size_t count() const {
    std::size_t set = 0;
    for (const std::uint64_t word : words_) set += std::size_t(std::popcount(word));
    return set;
  }

 private:
  static std::uint64_t bit_of(int x) { return std::uint64_t{1} << (x % kWordBits); }
  std::size_t first_word(int y, int z) const {
    return (std::size_t(z) * std::size_t(size_.y()) + std::size_t(y)) * std::size_t(words_per_row_);
  }
  std::uint64_t& word_of(int x, int y, int z) {
    return words_[first_word(y, z) + std::size_t(x / kWordBits)];
  }

  Eigen::Vector3i size_;
  int words_per_row_;
  std::vector<std::uint64_t> words_;
};

// Corner i of a cube of 2 x 2 x 2 points is at this offset: bits 0, 1 and 2 are x, y and z.
inline Eigen::Vector3i corner_offset(int corner) {
  return {corner & 1, corner >> 1 & 1, corner >> 2 & 1};
}

// Returns the bits of the cube whose lowest corner is the point, bit i for corner i. All corners
// must be in the grid.
inline unsigned cube_bits(const BitGrid& grid, const Eigen::Vector3i& at) {
  unsigned bits = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3i p = at + corner_offset(corner);
    bits |= unsigned(grid.at(p.x(), p.y(), p.z())) << corner;
  }
  return bits;
}

// Calls visit(at, cube_bits(grid, at)) for each cube of 2 x 2 x 2 points with both values, in
// ascending order of z, then y, then x. `visit` may set points of the cube.
template <class Visit>
void each_mixed_cube(const BitGrid& grid, const Visit& visit) {
  constexpr int kLast = BitGrid::kWordBits - 1;
  const Eigen::Vector3i& size = grid.size();
  for (int z = 0; z + 1 < size.z(); ++z)
    for (int y = 0; y + 1 < size.y(); ++y) {
      const std::uint64_t* const rows[] = {grid.row(y, z), grid.row(y + 1, z), grid.row(y, z + 1),
                                           grid.row(y + 1, z + 1)};
      for (int word = 0; word < grid.words_per_row(); ++word) {
        std::uint64_t any = 0, all = ~std::uint64_t{0}, next_any = 0, next_all = 1;
        for (const std::uint64_t* const row : rows) any |= row[word], all &= row[word];
        const bool is_last = word + 1 == grid.words_per_row();
        if (!is_last)
          for (const std::uint64_t* const row : rows)
            next_any |= row[word + 1] & 1, next_all &= row[word + 1] & 1;
        // Bit x: of the points x and x + 1.
        const std::uint64_t either = any | any >> 1 | next_any << kLast,
                            both = all & (all >> 1 | (is_last ? 0 : next_all) << kLast);
        for (std::uint64_t mixed = either & ~both; mixed != 0; mixed &= mixed - 1) {
          const Eigen::Vector3i at(word * BitGrid::kWordBits + std::countr_zero(mixed), y, z);
          if (at.x() + 1 < size.x()) visit(at, cube_bits(grid, at));
        }
      }
    }
}

}  // namespace fivepipe::surface
