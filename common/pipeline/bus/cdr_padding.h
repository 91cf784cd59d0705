// Pads a serialized sample as it travels. Internal to bus.
#pragma once
#include <cstddef>
#include <span>
#include <vector>

namespace fivepipe::bus::detail {

// Returns the bytes with zeros up to a multiple of four, whose number the low two bits of the
// options state (DDS-XTYPES 1.3, section 7.6.3.1.2). Cyclone DDS 0.10 sends that many bytes of a
// sample, also if it was given fewer. Requires the 4 bytes of encapsulation.
inline std::vector<std::byte> padded_to_words(std::span<const std::byte> cdr) {
  std::vector<std::byte> padded(cdr.begin(), cdr.end());
  if (const std::size_t lacking = (4 - cdr.size() % 4) % 4; lacking > 0) {
    padded.resize(cdr.size() + lacking);
    padded[3] = (padded[3] & ~std::byte(3)) | std::byte(lacking);
  }
  return padded;
}

}  // namespace fivepipe::bus::detail
