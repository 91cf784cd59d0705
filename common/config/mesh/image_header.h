// Checks of PNG and JPEG files without decoding them.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace fivepipe::config {

struct ImageSize {
  std::uint32_t width_px, height_px;
};

// Returns the size that the header of a PNG file (ISO/IEC 15948, section 11.2.2) or of a JPEG file
// (ITU-T T.81, section B.2.2) states, or nullopt. `bytes`: the beginning of the file.
std::optional<ImageSize> image_size(std::string_view bytes);

// Returns why the image cannot be a texture, or nullopt: it is neither PNG nor JPEG, it is larger
// than kMaxTextureSize_px, or, if the bytes are the whole file, it states no size or a JPEG file
// has no end. A decoder may still find it damaged.
std::optional<std::string> why_no_texture(std::string_view bytes, bool is_whole_file);

// The largest texture of common OpenGL drivers.
inline constexpr std::uint32_t kMaxTextureSize_px = 16384;
// Maximum size of an image file.
inline constexpr std::size_t kMaxImageBytes = std::size_t(256) << 20;

}  // namespace fivepipe::config
