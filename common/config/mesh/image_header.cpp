#include "common/config/mesh/image_header.h"

#include <fmt/format.h>

#include <cstdint>

namespace fivepipe::config {

namespace {

using namespace std::string_view_literals;

constexpr std::string_view kPngStart = "\x89PNG\r\n\x1a\n"sv, kJpegStart = "\xff\xd8\xff"sv;

// Returns `count` bytes at a position as a big-endian number. The bytes must be there.
std::uint32_t number_at(std::string_view bytes, std::size_t at, int count) {
  std::uint32_t number = 0;
  for (int i = 0; i < count; ++i) number = number << 8 | std::uint8_t(bytes[at + std::size_t(i)]);
  return number;
}

// Frame headers of all coding processes: SOF0 to SOF15 without DHT, JPG and DAC.
bool is_frame_header(std::uint8_t marker) {
  return marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
}

// The segments of a JPEG file until its first scan.
struct JpegSegments {
  std::optional<ImageSize> size;
  std::optional<std::size_t> scan_at;  // position after the marker of the scan
};
JpegSegments jpeg_segments(std::string_view bytes) {
  constexpr std::uint8_t kStartOfScan = 0xDA;
  JpegSegments found;
  for (std::size_t at = 2; at + 4 <= bytes.size() && bytes[at] == '\xff';) {
    const auto marker = std::uint8_t(bytes[at + 1]);
    if (marker == 0xFF) {  // a fill byte
      ++at;
      continue;
    }
    if (marker == kStartOfScan) {
      found.scan_at = at + 2;
      break;
    }
    if (is_frame_header(marker) && at + 9 <= bytes.size())
      found.size = ImageSize{number_at(bytes, at + 7, 2), number_at(bytes, at + 5, 2)};
    at += 2 + number_at(bytes, at + 2, 2);
  }
  return found;
}

}  // namespace

std::optional<ImageSize> image_size(std::string_view bytes) {
  std::optional<ImageSize> size;
  if (bytes.starts_with(kPngStart)) {
    if (bytes.size() >= 24 && bytes.substr(12, 4) == "IHDR")
      size = ImageSize{number_at(bytes, 16, 4), number_at(bytes, 20, 4)};
  } else if (bytes.starts_with(kJpegStart)) {
    size = jpeg_segments(bytes).size;
  }
  return size && size->width_px > 0 && size->height_px > 0 ? size : std::nullopt;
}

std::optional<std::string> why_no_texture(std::string_view bytes, bool is_whole_file) {
  const bool is_jpeg = bytes.starts_with(kJpegStart);
  if (!is_jpeg && !bytes.starts_with(kPngStart)) return "it is neither a PNG nor a JPEG image";
  const auto size = image_size(bytes);
  if (size && (size->width_px > kMaxTextureSize_px || size->height_px > kMaxTextureSize_px))
    return fmt::format("it has {}x{} pixels, the limit is {}x{}", size->width_px, size->height_px,
                       kMaxTextureSize_px, kMaxTextureSize_px);
  if (!is_whole_file) return std::nullopt;
  if (!size) return "the image is damaged: its header states no size";
  if (!is_jpeg) return std::nullopt;
  // Within a scan no byte 0xFF is followed by the marker of the end.
  const auto scan_at = jpeg_segments(bytes).scan_at;
  if (!scan_at || bytes.find("\xff\xd9"sv, *scan_at) == std::string_view::npos)
    return "the image is damaged: its end is missing";
  return std::nullopt;
}

}  // namespace fivepipe::config
