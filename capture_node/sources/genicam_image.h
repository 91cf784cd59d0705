// Pixel formats of GenICam cameras (GenICam Pixel Format Naming Convention 2.4) that fivepipe
// converts to BGR.
#pragma once
#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

namespace fivepipe::capture {

// Colour before grey, and formats with fewer bytes before others: the network limits the rate of
// most cameras. A Bayer format names the colours of the first two pixels.
enum class GenicamFormat : std::uint32_t {
  bayer_rg8 = 0x01080009,
  bayer_gr8 = 0x01080008,
  bayer_gb8 = 0x0108000A,
  bayer_bg8 = 0x0108000B,
  yuv422_yuyv = 0x02100032,
  yuv422_uyvy = 0x0210001F,
  bgr8 = 0x02180015,
  rgb8 = 0x02180014,
  mono8 = 0x01080001,
};

// Returns the format to set: the camera's present one if it is in colour, or else the first one
// above that the camera has. Returns nullopt if the camera has none of them.
std::optional<GenicamFormat> best_format(std::int64_t present,
                                         const std::vector<std::int64_t>& available);

// "BayerRG8": the name in the convention.
std::string name_of(GenicamFormat format);
std::optional<GenicamFormat> format_named(const std::string& name);
// Bits of a pixel on the wire.
int bits_per_pixel(GenicamFormat format);

// Returns an 8-bit BGR image with its own memory, or an empty one if the format is none of those
// above, or if `size` bytes are too few. padding: bytes after each row. Grey images become BGR of
// equal channels; an odd width of YUV and a Bayer image below 2x2 are refused.
cv::Mat bgr_of(std::uint32_t format, int width_px, int height_px, const void* bytes,
               std::size_t size, int padding = 0);

}  // namespace fivepipe::capture
