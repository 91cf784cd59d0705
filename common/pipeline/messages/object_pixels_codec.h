// The two encodings of the object pixels inside a region (MapEncoding in the IDL).
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/hull/object_pixels.h"
#include "fivepipe.h"

namespace fivepipe::messages {

// Encodes each row of the region, padded to whole bytes, least significant bit first. `region` must
// be inside the image.
std::vector<std::uint8_t> packed_bits(const hull::ObjectPixels& pixels,
                                      const hull::PixelRect& region);
// Encodes each row of the region as pairs of little-endian uint16 (pixels skipped, pixels set),
// ended by (0, 0). The image must be at most 65,535 pixels wide.
std::vector<std::uint8_t> run_lengths(const hull::ObjectPixels& pixels,
                                      const hull::PixelRect& region);

// Chooses run lengths if they are shorter, else packed bits. Builds only the chosen encoding.
struct EncodedPixels {
  fivepipe_v1_MapEncoding encoding;
  std::vector<std::uint8_t> payload;
};
EncodedPixels encoded(const hull::ObjectPixels& pixels, const hull::PixelRect& region);

// Returns nullopt unless the payload is exactly the encoder's output for this region: not if it is
// too short or too long, a run exceeds the row, or padding bits are set. `region` must be inside
// the image or empty.
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
