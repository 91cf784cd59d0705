#include "capture_node/sources/genicam_image.h"

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>

namespace fivepipe::capture {
namespace {

struct Conversion {
  GenicamFormat format;
  const char* name;
  int bytes;   // per pixel
  int to_bgr;  // cv::ColorConversionCodes; kCopy: none
};
constexpr int kCopy = -1;
constexpr std::array<Conversion, 9> kConversions{{
    {GenicamFormat::bayer_rg8, "BayerRG8", 1, cv::COLOR_BayerRGGB2BGR},
    {GenicamFormat::bayer_gr8, "BayerGR8", 1, cv::COLOR_BayerGRBG2BGR},
    {GenicamFormat::bayer_gb8, "BayerGB8", 1, cv::COLOR_BayerGBRG2BGR},
    {GenicamFormat::bayer_bg8, "BayerBG8", 1, cv::COLOR_BayerBGGR2BGR},
    {GenicamFormat::yuv422_yuyv, "YUV422_8", 2, cv::COLOR_YUV2BGR_YUYV},
    {GenicamFormat::yuv422_uyvy, "YUV422_8_UYVY", 2, cv::COLOR_YUV2BGR_UYVY},
    {GenicamFormat::bgr8, "BGR8", 3, kCopy},
    {GenicamFormat::rgb8, "RGB8", 3, cv::COLOR_RGB2BGR},
    {GenicamFormat::mono8, "Mono8", 1, cv::COLOR_GRAY2BGR},
}};

const Conversion* conversion_of(std::int64_t format) {
  const auto* const found = std::find_if(
      kConversions.begin(), kConversions.end(),
      [&](const Conversion& conversion) { return std::int64_t(conversion.format) == format; });
  return found == kConversions.end() ? nullptr : found;
}

bool is_bayer(GenicamFormat format) {
  return format >= GenicamFormat::bayer_gr8 && format <= GenicamFormat::bayer_bg8;
}

bool is_yuv(GenicamFormat format) {
  return format == GenicamFormat::yuv422_yuyv || format == GenicamFormat::yuv422_uyvy;
}

}  // namespace

std::optional<GenicamFormat> best_format(std::int64_t present,
                                         const std::vector<std::int64_t>& available) {
  if (const Conversion* conversion = conversion_of(present);
      conversion && conversion->format != GenicamFormat::mono8)
    return conversion->format;
  for (const Conversion& conversion : kConversions)
    if (std::find(available.begin(), available.end(), std::int64_t(conversion.format)) !=
        available.end())
      return conversion.format;
  return std::nullopt;
}

std::string name_of(GenicamFormat format) { return conversion_of(std::int64_t(format))->name; }

std::optional<GenicamFormat> format_named(const std::string& name) {
  for (const Conversion& conversion : kConversions)
    if (name == conversion.name) return conversion.format;
  return std::nullopt;
}

int bits_per_pixel(GenicamFormat format) { return 8 * conversion_of(std::int64_t(format))->bytes; }

cv::Mat bgr_of(std::uint32_t format, int width_px, int height_px, const void* bytes,
               std::size_t size, int padding) {
  const Conversion* const conversion = conversion_of(format);
  if (!conversion || width_px <= 0 || height_px <= 0 || bytes == nullptr || padding < 0) return {};
  const std::size_t row = std::size_t(conversion->bytes) * std::size_t(width_px),
                    stride = row + std::size_t(padding);
  if (size < stride * std::size_t(height_px - 1) + row ||
      (is_yuv(conversion->format) && width_px % 2 != 0) ||
      (is_bayer(conversion->format) && (width_px < 2 || height_px < 2)))
    return {};
  const cv::Mat raw(height_px, width_px, CV_8UC(conversion->bytes), const_cast<void*>(bytes),
                    stride);
  cv::Mat bgr;
  if (conversion->to_bgr == kCopy)
    raw.copyTo(bgr);
  else
    cv::cvtColor(raw, bgr, conversion->to_bgr);
  return bgr;
}

}  // namespace fivepipe::capture
