// Combines three neighbours in a row by shifting whole words, then three rows, because the 3x3
// square is separable. Repeats this radius_px times.
#include "capture_node/segmentation/bit_morphology.h"

#include <algorithm>
#include <vector>

namespace fivepipe::capture {
namespace {

enum class Step { erode, dilate };

std::uint64_t last_word_mask(int width_px) {
  return width_px % 64 == 0 ? ~std::uint64_t(0) : (std::uint64_t(1) << (width_px % 64)) - 1;
}

template <Step step>
std::uint64_t combine(std::uint64_t a, std::uint64_t b, std::uint64_t c) {
  return step == Step::erode ? a & b & c : a | b | c;
}

// Combines each pixel with its left and right neighbour. Pixels beyond the row are `kOutside`.
template <Step step>
void row_of_three(const std::uint64_t* in, std::uint64_t* out, int words, std::uint64_t last_mask) {
  constexpr std::uint64_t kOutside = step == Step::erode ? ~std::uint64_t(0) : 0;
  const auto word = [&](int w) {
    return w + 1 == words ? (in[w] & last_mask) | (kOutside & ~last_mask) : in[w];
  };
  std::uint64_t before = kOutside, here = word(0);
  for (int w = 0; w < words; ++w) {
    const std::uint64_t after = w + 1 < words ? word(w + 1) : kOutside;
    out[w] = combine<step>(here, here << 1 | before >> 63, here >> 1 | after << 63);
    before = here;
    here = after;
  }
}

template <Step step>
void one_step(hull::ObjectPixels& pixels) {
  const int words = pixels.words_per_row(), rows = pixels.height_px();
  if (words == 0 || rows == 0) return;
  const std::uint64_t last_mask = last_word_mask(pixels.width_px());
  const std::uint64_t outside = step == Step::erode ? ~std::uint64_t(0) : 0;
  std::vector<std::uint64_t> above(words, outside), here(words), below(words);
  std::uint64_t* image = pixels.mutable_words().data();
  row_of_three<step>(image, here.data(), words, last_mask);
  for (int v = 0; v < rows; ++v) {
    std::uint64_t* row = image + std::size_t(v) * words;
    if (v + 1 < rows)
      row_of_three<step>(row + words, below.data(), words, last_mask);
    else
      std::fill(below.begin(), below.end(), outside);
    for (int w = 0; w < words; ++w) row[w] = combine<step>(above[w], here[w], below[w]);
    row[words - 1] &= last_mask;
    std::swap(above, here);
    std::swap(here, below);
  }
}

// The number of set pixels among each pixel and its left and right neighbour, in binary: bit i of
// `ones` and of `twos` belong to pixel i.
void count_row_of_three(const std::uint64_t* in, std::uint64_t* ones, std::uint64_t* twos,
                        int words) {
  for (int w = 0; w < words; ++w) {
    const std::uint64_t here = in[w], left = here << 1 | (w > 0 ? in[w - 1] >> 63 : 0),
                        right = here >> 1 | (w + 1 < words ? in[w + 1] << 63 : 0);
    ones[w] = left ^ here ^ right;
    twos[w] = (left & here) | (right & (left ^ here));
  }
}

// Returns the pixels whose sum of three counts is at least `count`.
std::uint64_t sum_is_at_least(int count, const std::uint64_t (&ones)[3],
                              const std::uint64_t (&twos)[3]) {
  const auto sum = [](std::uint64_t a, std::uint64_t b, std::uint64_t c) { return a ^ b ^ c; };
  const auto carry = [](std::uint64_t a, std::uint64_t b, std::uint64_t c) {
    return (a & b) | (c & (a ^ b));
  };
  const std::uint64_t bit0 = sum(ones[0], ones[1], ones[2]),
                      carry0 = carry(ones[0], ones[1], ones[2]),
                      twos_sum = sum(twos[0], twos[1], twos[2]),
                      fours = carry(twos[0], twos[1], twos[2]), bit1 = twos_sum ^ carry0,
                      carry1 = twos_sum & carry0, bit2 = fours ^ carry1, bit3 = fours & carry1;
  // sum >= count, from the lowest bit: a higher bit decides unless it is equal.
  const std::uint64_t bits[4] = {bit0, bit1, bit2, bit3};
  std::uint64_t is_at_least = ~std::uint64_t(0);
  for (int i = 0; i < 4; ++i) {
    const std::uint64_t equal = count >> i & 1 ? 0 : ~std::uint64_t(0);
    is_at_least = (bits[i] & is_at_least) | (equal & (bits[i] | is_at_least));
  }
  return is_at_least;
}

}  // namespace

hull::ObjectPixels with_neighbours(const hull::ObjectPixels& pixels, int count) {
  hull::ObjectPixels result(pixels.width_px(), pixels.height_px());
  const int words = pixels.words_per_row(), rows = pixels.height_px();
  if (words == 0 || rows == 0) return result;
  const std::uint64_t last_mask = last_word_mask(pixels.width_px());
  const auto row_words = std::size_t(words);
  // Counts of the rows above, here and below; rows beyond the image stay zero.
  std::vector<std::uint64_t> counts(6 * row_words);
  std::uint64_t* rows_of_counts[3] = {counts.data(), counts.data() + 2 * row_words,
                                      counts.data() + 4 * row_words};
  const auto count_row = [&](int v, std::uint64_t* to) {
    if (v < rows)
      count_row_of_three(pixels.words().data() + std::size_t(v) * row_words, to, to + row_words,
                         words);
    else
      std::fill_n(to, 2 * row_words, 0);
  };
  count_row(0, rows_of_counts[1]);
  for (int v = 0; v < rows; ++v) {
    count_row(v + 1, rows_of_counts[2]);
    const auto [above, here, below] = rows_of_counts;
    std::uint64_t* const out = result.mutable_words().data() + std::size_t(v) * row_words;
    for (std::size_t w = 0; w < row_words; ++w) {
      const std::size_t t = w + row_words;
      out[w] = sum_is_at_least(count, {above[w], here[w], below[w]}, {above[t], here[t], below[t]});
    }
    out[row_words - 1] &= last_mask;
    std::rotate(std::begin(rows_of_counts), std::begin(rows_of_counts) + 1,
                std::end(rows_of_counts));
  }
  return result;
}

hull::ObjectPixels eroded(hull::ObjectPixels pixels, int radius_px) {
  for (int i = 0; i < radius_px; ++i) one_step<Step::erode>(pixels);
  return pixels;
}

hull::ObjectPixels dilated(hull::ObjectPixels pixels, int radius_px) {
  for (int i = 0; i < radius_px; ++i) one_step<Step::dilate>(pixels);
  return pixels;
}

hull::ObjectPixels opened(hull::ObjectPixels pixels, int radius_px) {
  return dilated(eroded(std::move(pixels), radius_px), radius_px);
}
hull::ObjectPixels closed(hull::ObjectPixels pixels, int radius_px) {
  return eroded(dilated(std::move(pixels), radius_px), radius_px);
}

}  // namespace fivepipe::capture
