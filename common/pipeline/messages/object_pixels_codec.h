// Two encodings of the object pixels inside a region (idl: MapEncoding).
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/hull/object_pixels.h"
#include "fivepipe.h"

namespace fivepipe::messages {

// Rows of the region, each padded to whole bytes, least significant bit first. `region` lies inside
// the image.
std::vector<std::uint8_t> packed_bits(const hull::ObjectPixels& pixels,
                                      const hull::PixelRect& region);
// Per row of the region pairs of little-endian uint16 (pixels skipped, pixels set), ended by (0,
// 0). Images up to 65,535 pixels wide.
std::vector<std::uint8_t> run_lengths(const hull::ObjectPixels& pixels,
                                      const hull::PixelRect& region);

// The shorter of the two.
struct EncodedPixels {
  fivepipe_v1_MapEncoding encoding;
  std::vector<std::uint8_t> payload;
};
EncodedPixels encoded(const hull::ObjectPixels& pixels, const hull::PixelRect& region);

// Nothing where the payload is not exactly what the encoder makes for this region: too short, too
// long, runs beyond the row, padding bits set. `region` must lie inside the image, or be empty.
std::optional<hull::ObjectPixels> from_packed_bits(int width_px, int height_px,
                                                   const hull::PixelRect& region,
                                                   std::span<const std::uint8_t> payload);
std::optional<hull::ObjectPixels> from_run_lengths(int width_px, int height_px,
                                                   const hull::PixelRect& region,
                                                   std::span<const std::uint8_t> payload);
std::optional<hull::ObjectPixels> decoded(fivepipe_v1_MapEncoding encoding, int width_px,
                                          int height_px, const hull::PixelRect& region,
                                          std::span<const std::uint8_t> payload);

}  // namespace fivepipe::messages
