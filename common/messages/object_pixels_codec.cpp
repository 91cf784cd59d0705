#include "common/messages/object_pixels_codec.h"

#include <algorithm>
#include <bit>

namespace fivepipe {
namespace {

// First pixel at or after u whose state is `object`, at most `end`.
int next_with_state(std::span<const std::uint64_t> row, int u, int end, bool object) {
  while (u < end) {
    const std::uint64_t word = (object ? row[std::size_t(u) >> 6] : ~row[std::size_t(u) >> 6]) >> (u & 63);
    if (word) return std::min(end, u + std::countr_zero(word));
    u = (u | 63) + 1;
  }
  return end;
}

void set_run(std::span<std::uint64_t> row, int begin, int end) {
  for (int u = begin; u < end;) {
    const int stop = std::min(end, (u | 63) + 1);
    const std::uint64_t ones = stop - u == 64 ? ~std::uint64_t(0) : (std::uint64_t(1) << (stop - u)) - 1;
    row[std::size_t(u) >> 6] |= ones << (u & 63);
    u = stop;
  }
}

template <class Words>
auto row_of(Words words, const ObjectPixels& pixels, int v) {
  return words.subspan(std::size_t(v) * std::size_t(pixels.words_per_row()), std::size_t(pixels.words_per_row()));
}

// 64 pixels from u on; those beyond the row are zero.
std::uint64_t bits_at(std::span<const std::uint64_t> row, int u) {
  const std::size_t word = std::size_t(u) >> 6;
  const int shift = u & 63;
  std::uint64_t bits = row[word] >> shift;
  if (shift && word + 1 < row.size()) bits |= row[word + 1] << (64 - shift);
  return bits;
}

}  // namespace

std::vector<std::uint8_t> packed_bits(const ObjectPixels& pixels, const PixelRect& region) {
  const int bytes_per_row = (region.width_px() + 7) / 8;
  std::vector<std::uint8_t> payload;
  payload.reserve(std::size_t(bytes_per_row) * std::size_t(region.height_px()));
  for (int v = region.v0_px; v < region.v1_px; ++v) {
    const auto row = row_of(pixels.words(), pixels, v);
    for (int byte = 0; byte < bytes_per_row; ++byte) {
      const int used = std::min(8, region.width_px() - 8 * byte);
      payload.push_back(std::uint8_t(bits_at(row, region.u0_px + 8 * byte) & ((1u << used) - 1)));
    }
  }
  return payload;
}

std::vector<std::uint8_t> run_lengths(const ObjectPixels& pixels, const PixelRect& region) {
  std::vector<std::uint8_t> payload;
  const auto put = [&](int value) {
    payload.push_back(std::uint8_t(value & 0xff));
    payload.push_back(std::uint8_t(value >> 8));
  };
  for (int v = region.v0_px; v < region.v1_px; ++v) {
    const auto row = row_of(pixels.words(), pixels, v);
    for (int u = region.u0_px;;) {
      const int begin = next_with_state(row, u, region.u1_px, true);
      if (begin == region.u1_px) break;
      const int end = next_with_state(row, begin, region.u1_px, false);
      put(begin - u);
      put(end - begin);
      u = end;
    }
    put(0);
    put(0);
  }
  return payload;
}

std::optional<ObjectPixels> from_packed_bits(int width_px, int height_px, const PixelRect& region, std::span<const std::uint8_t> payload) {
  const int bytes_per_row = (region.width_px() + 7) / 8;
  if (payload.size() != std::size_t(bytes_per_row) * std::size_t(region.height_px())) return std::nullopt;
  ObjectPixels pixels(width_px, height_px);
  for (int v = region.v0_px; v < region.v1_px; ++v) {
    const auto row = row_of(pixels.mutable_words(), pixels, v);
    for (int byte = 0; byte < bytes_per_row; ++byte) {
      const std::uint64_t bits = payload[std::size_t(v - region.v0_px) * std::size_t(bytes_per_row) + std::size_t(byte)];
      const int used = std::min(8, region.width_px() - 8 * byte);
      if (bits >> used) return std::nullopt;
      const int u = region.u0_px + 8 * byte, shift = u & 63;
      row[std::size_t(u) >> 6] |= bits << shift;
      if (shift > 56 && (std::size_t(u) >> 6) + 1 < row.size()) row[(std::size_t(u) >> 6) + 1] |= bits >> (64 - shift);
    }
  }
  return pixels;
}

std::optional<ObjectPixels> from_run_lengths(int width_px, int height_px, const PixelRect& region, std::span<const std::uint8_t> payload) {
  if (payload.size() % 4 != 0) return std::nullopt;
  ObjectPixels pixels(width_px, height_px);
  std::size_t at = 0;
  for (int v = region.v0_px; v < region.v1_px; ++v) {
    for (int u = region.u0_px;;) {
      if (at == payload.size()) return std::nullopt;
      const int skipped = payload[at] | payload[at + 1] << 8, run = payload[at + 2] | payload[at + 3] << 8;
      at += 4;
      if (run == 0 && skipped == 0) break;
      // After the first run of a row something must be skipped, else two runs would be one.
      if (run == 0 || (skipped == 0 && u != region.u0_px) || skipped + run > region.u1_px - u) return std::nullopt;
      set_run(row_of(pixels.mutable_words(), pixels, v), u + skipped, u + skipped + run);
      u += skipped + run;
    }
  }
  return at == payload.size() ? std::optional(std::move(pixels)) : std::nullopt;
}

}  // namespace fivepipe
