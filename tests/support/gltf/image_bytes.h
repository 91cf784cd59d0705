// Bytes of small image files.
#pragma once
#include <cstdint>
#include <string>

namespace fivepipe::test {

// Returns the CRC of a PNG chunk's type and data (ISO/IEC 15948, annex D).
inline std::uint32_t png_crc(const std::string& bytes) {
  std::uint32_t crc = 0xFFFFFFFF;
  for (const char byte : bytes) {
    crc ^= std::uint8_t(byte);
    for (int bit = 0; bit < 8; ++bit) crc = crc & 1 ? 0xEDB88320 ^ crc >> 1 : crc >> 1;
  }
  return ~crc;
}

inline std::string big_endian(std::uint32_t number) {
  return {char(number >> 24), char(number >> 16), char(number >> 8), char(number)};
}

inline std::string png_chunk(const std::string& type, const std::string& data) {
  return big_endian(std::uint32_t(data.size())) + type + data + big_endian(png_crc(type + data));
}

// Returns the start and the header of a PNG file of this size with 8-bit RGB; without its pixels.
inline std::string png_header(std::uint32_t width_px, std::uint32_t height_px) {
  return "\x89PNG\r\n\x1a\n" + png_chunk("IHDR", big_endian(width_px) + big_endian(height_px) +
                                                     std::string("\x08\x02\0\0\0", 5));
}

}  // namespace fivepipe::test
