#include "common/pipeline/messages/object_pixels_codec.h"

#include <algorithm>
#include <limits>

namespace fivepipe::messages {
namespace {

template <class Words>
auto words_of_row(Words words, const hull::ObjectPixels& pixels, int v) {
  return words.subspan(std::size_t(v) * std::size_t(pixels.words_per_row()),
                       std::size_t(pixels.words_per_row()));
}

// Returns 64 pixels from u on; those beyond the row are zero.
std::uint64_t bits_at(std::span<const std::uint64_t> row, int u) {
  const std::size_t word = std::size_t(u) >> 6;
  const int shift = u & 63;
  std::uint64_t bits = row[word] >> shift;
  if (shift && word + 1 < row.size()) bits |= row[word + 1] << (64 - shift);
  return bits;
}

int packed_bytes_per_row(const hull::PixelRect& region) { return (region.width_px() + 7) / 8; }

std::size_t packed_bits_bytes(const hull::PixelRect& region) {
  return std::size_t(packed_bytes_per_row(region)) * std::size_t(region.height_px());
}

hull::PixelRect row_of(const hull::PixelRect& region, int v) {
  return {region.u0_px, v, region.u1_px, v + 1};
}

// Returns the size of run_lengths() [bytes]. Stops counting after the first row with which it
// reaches `limit_bytes`.
std::size_t run_lengths_bytes(const hull::ObjectPixels& pixels, const hull::PixelRect& region,
                              std::size_t limit_bytes) {
  constexpr std::size_t kPairBytes = 4;
  std::size_t bytes = 0;
  for (int v = region.v0_px; v < region.v1_px && bytes < limit_bytes; ++v) {
    bytes += kPairBytes;  // the end of the row
    pixels.for_each_run(row_of(region, v), [&](int, int, int) { bytes += kPairBytes; });
  }
  return bytes;
}

std::vector<std::uint8_t> run_lengths(const hull::ObjectPixels& pixels,
                                      const hull::PixelRect& region, std::size_t bytes) {
  std::vector<std::uint8_t> payload;
  payload.reserve(bytes);
  const auto put = [&](int value) {
    payload.push_back(std::uint8_t(value & 0xff));
    payload.push_back(std::uint8_t(value >> 8));
  };
  for (int v = region.v0_px; v < region.v1_px; ++v) {
    int after = region.u0_px;
    pixels.for_each_run(row_of(region, v), [&](int, int begin, int end) {
      put(begin - after);
      put(end - begin);
      after = end;
    });
    put(0);
    put(0);
  }
  return payload;
}

}  // namespace

std::vector<std::uint8_t> packed_bits(const hull::ObjectPixels& pixels,
                                      const hull::PixelRect& region) {
  const int bytes_per_row = packed_bytes_per_row(region);
  std::vector<std::uint8_t> payload;
  payload.reserve(packed_bits_bytes(region));
  for (int v = region.v0_px; v < region.v1_px; ++v) {
    const auto row = words_of_row(pixels.words(), pixels, v);
    for (int byte = 0; byte < bytes_per_row; ++byte) {
      const int used = std::min(8, region.width_px() - 8 * byte);
      payload.push_back(std::uint8_t(bits_at(row, region.u0_px + 8 * byte) & ((1u << used) - 1)));
    }
  }
  return payload;
}

std::vector<std::uint8_t> run_lengths(const hull::ObjectPixels& pixels,
                                      const hull::PixelRect& region) {
  constexpr std::size_t kNoLimit = std::numeric_limits<std::size_t>::max();
  return run_lengths(pixels, region, run_lengths_bytes(pixels, region, kNoLimit));
}

EncodedPixels encoded(const hull::ObjectPixels& pixels, const hull::PixelRect& region) {
  const std::size_t packed_bytes = packed_bits_bytes(region),
                    runs_bytes = run_lengths_bytes(pixels, region, packed_bytes);
  if (runs_bytes < packed_bytes)
    return {fivepipe_v1_run_lengths, run_lengths(pixels, region, runs_bytes)};
  return {fivepipe_v1_packed_bits, packed_bits(pixels, region)};
}

std::optional<hull::ObjectPixels> decoded(fivepipe_v1_MapEncoding encoding, int width_px,
                                          int height_px, const hull::PixelRect& region,
                                          std::span<const std::uint8_t> payload) {
  switch (encoding) {
    case fivepipe_v1_packed_bits: return from_packed_bits(width_px, height_px, region, payload);
    case fivepipe_v1_run_lengths: return from_run_lengths(width_px, height_px, region, payload);
  }
  return std::nullopt;
}

std::optional<hull::ObjectPixels> from_packed_bits(int width_px, int height_px,
                                                   const hull::PixelRect& region,
                                                   std::span<const std::uint8_t> payload) {
  if (payload.size() != packed_bits_bytes(region)) return std::nullopt;
  const int bytes_per_row = packed_bytes_per_row(region);
  hull::ObjectPixels pixels(width_px, height_px);
  for (int v = region.v0_px; v < region.v1_px; ++v) {
    const auto row = words_of_row(pixels.mutable_words(), pixels, v);
    for (int byte = 0; byte < bytes_per_row; ++byte) {
      const std::uint64_t bits =
          payload[std::size_t(v - region.v0_px) * std::size_t(bytes_per_row) + std::size_t(byte)];
      const int used = std::min(8, region.width_px() - 8 * byte);
      if (bits >> used) return std::nullopt;
      const int u = region.u0_px + 8 * byte, shift = u & 63;
      row[std::size_t(u) >> 6] |= bits << shift;
      if (shift > 56 && (std::size_t(u) >> 6) + 1 < row.size())
        row[(std::size_t(u) >> 6) + 1] |= bits >> (64 - shift);
    }
  }
  return pixels;
}

std::optional<hull::ObjectPixels> from_run_lengths(int width_px, int height_px,
                                                   const hull::PixelRect& region,
                                                   std::span<const std::uint8_t> payload) {
  if (payload.size() % 4 != 0) return std::nullopt;
  hull::ObjectPixels pixels(width_px, height_px);
  std::size_t at = 0;
  for (int v = region.v0_px; v < region.v1_px; ++v) {
    for (int u = region.u0_px;;) {
      if (at == payload.size()) return std::nullopt;
      const int skipped = payload[at] | payload[at + 1] << 8,
                run = payload[at + 2] | payload[at + 3] << 8;
      at += 4;
      if (run == 0 && skipped == 0) break;
      // Only the first run of a row may skip no pixel: otherwise two runs would be one.
      if (run == 0 || (skipped == 0 && u != region.u0_px) || skipped + run > region.u1_px - u)
        return std::nullopt;
      pixels.set_run(u + skipped, u + skipped + run, v);
      u += skipped + run;
    }
  }
  return at == payload.size() ? std::optional(std::move(pixels)) : std::nullopt;
}

}  // namespace fivepipe::messages
