#include "launch/export/depth_file.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

namespace fivepipe::exports {
namespace {

constexpr float kMillimetres_m = 1000, kMaxPng_mm = 65535;

cv::Mat image_of(const hull::DepthTile& depth, DepthFormat format) {
  const int width = depth.rect.width_px(), height = depth.rect.height_px();
  cv::Mat image(height, width, format == DepthFormat::png ? CV_16UC1 : CV_32FC1);
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) {
      const float depth_m = depth.depth_m[std::size_t(v) * std::size_t(width) + std::size_t(u)];
      if (format == DepthFormat::png)
        image.at<std::uint16_t>(v, u) =
            std::uint16_t(std::lround(std::min(kMillimetres_m * depth_m, kMaxPng_mm)));
      else
        image.at<float>(v, u) = depth_m;
    }
  return image;
}

}  // namespace

std::optional<DepthFormat> depth_format_from(std::string_view text) {
  if (text == "png") return DepthFormat::png;
  if (text == "exr") return DepthFormat::exr;
  return std::nullopt;
}

std::string extension_of(DepthFormat format) {
  return format == DepthFormat::png ? ".png" : ".exr";
}

void enable_exr() { setenv("OPENCV_IO_ENABLE_OPENEXR", "1", 1); }

void write_depth(const std::filesystem::path& file, const hull::DepthTile& depth,
                 DepthFormat format) {
  try {
    // EXR: floats, not the half floats of the default.
    const std::vector<int> parameters =
        format == DepthFormat::exr
            ? std::vector<int>{cv::IMWRITE_EXR_TYPE, cv::IMWRITE_EXR_TYPE_FLOAT}
            : std::vector<int>{};
    if (cv::imwrite(file.string(), image_of(depth, format), parameters)) return;
  } catch (const cv::Exception& error) {
    throw std::runtime_error("cannot write " + file.string() + ": " + error.what());
  }
  throw std::runtime_error("cannot write " + file.string());
}

}  // namespace fivepipe::exports
