#include "capture_node/segmentation/matte.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace fivepipe::capture {
namespace {

// Chroma of b, g, r (ITU-R BT.601, full range), in the unit of these.
struct Chroma {
  float cb, cr;
};
Chroma chroma(float b, float g, float r) {
  return {-0.168736f * r - 0.331264f * g + 0.5f * b, 0.5f * r - 0.418688f * g - 0.081312f * b};
}

// The pixels with a level of at least kOpaque_levels in one of the channels [first, end).
hull::ObjectPixels opaque_pixels(const cv::Mat& image, int first, int end) {
  const int step = image.channels();
  hull::ObjectPixels pixels(image.cols, image.rows);
  const auto words = std::size_t(pixels.words_per_row());
  for (int v = 0; v < image.rows; ++v) {
    std::uint64_t* const row = pixels.mutable_words().data() + std::size_t(v) * words;
    const std::uint8_t* const levels = image.ptr(v);
    for (int u = 0; u < image.cols; ++u) {
      bool is_opaque = false;
      for (int c = first; c < end; ++c) is_opaque |= levels[step * u + c] >= kOpaque_levels;
      row[u / 64] |= std::uint64_t(is_opaque) << (u % 64);
    }
  }
  return pixels;
}

// The brightest of the channels [first, end).
hull::CoverageMap brightest(const cv::Mat& image, int first, int end) {
  hull::CoverageMap coverage(image.cols, image.rows);
  const int step = image.channels();
  for (int v = 0; v < image.rows; ++v)
    for (int u = 0; u < image.cols; ++u) {
      const std::uint8_t* const levels = image.ptr(v) + step * u;
      coverage.set(u, v, *std::max_element(levels + first, levels + end));
    }
  return coverage;
}

}  // namespace

hull::CoverageMap coverage_of_mask(const cv::Mat& mask) {
  assert(mask.depth() == CV_8U && mask.channels() <= 3);
  return brightest(mask, 0, mask.channels());
}

hull::CoverageMap coverage_of_alpha(const cv::Mat& bgra) {
  assert(bgra.type() == CV_8UC4);
  return brightest(bgra, 3, 4);
}

hull::ObjectPixels pixels_of_mask(const cv::Mat& mask) {
  assert(mask.depth() == CV_8U && mask.channels() <= 3);
  return opaque_pixels(mask, 0, mask.channels());
}

hull::ObjectPixels pixels_of_alpha(const cv::Mat& bgra) {
  assert(bgra.type() == CV_8UC4);
  return opaque_pixels(bgra, 3, 4);
}

ChromaKeyer::ChromaKeyer(const config::ChromaKey& key) {
  const Chroma of_key =
      chroma(255 * float(key.rgb[2]), 255 * float(key.rgb[1]), 255 * float(key.rgb[0]));
  const float length = std::hypot(of_key.cb, of_key.cr);
  assert(length > 0);
  cb_ = of_key.cb / length;
  cr_ = of_key.cr / length;
  min_chroma_ = float(key.min_chroma) * length;
  const float cosine = std::cos(float(key.max_angle_deg * std::numbers::pi / 180));
  squared_cosine_ = cosine * cosine;
}

hull::ObjectPixels ChromaKeyer::object_pixels(const cv::Mat& image_bgr) const {
  assert(image_bgr.type() == CV_8UC3);
  hull::ObjectPixels pixels(image_bgr.cols, image_bgr.rows);
  const auto words = std::size_t(pixels.words_per_row());
  for (int v = 0; v < image_bgr.rows; ++v) {
    std::uint64_t* const row = pixels.mutable_words().data() + std::size_t(v) * words;
    const std::uint8_t* const bgr = image_bgr.ptr(v);
    for (int u = 0; u < image_bgr.cols; ++u) {
      const Chroma c = chroma(bgr[3 * u], bgr[3 * u + 1], bgr[3 * u + 2]);
      const float along = c.cb * cb_ + c.cr * cr_, squared = c.cb * c.cb + c.cr * c.cr;
      const bool is_screen = along > 0 && squared >= min_chroma_ * min_chroma_ &&
                             along * along >= squared_cosine_ * squared;
      row[u / 64] |= std::uint64_t(!is_screen) << (u % 64);
    }
  }
  return pixels;
}

}  // namespace fivepipe::capture
