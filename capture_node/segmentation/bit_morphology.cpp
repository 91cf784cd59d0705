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

}  // namespace

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
