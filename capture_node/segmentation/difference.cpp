#include "capture_node/segmentation/difference.h"

#include <cassert>
#include <cmath>
#include <opencv2/core/hal/intrin.hpp>

namespace fivepipe::capture {
namespace {

struct RowTables {
  std::array<const std::uint8_t*, 3> low, high;
};

struct Bits16 {
  std::uint64_t differs, darker;
};

// Returns the bits of 16 pixels; four of them make one 64-pixel word. For a target without SIMD,
// OpenCV emulates the vectors by arrays.
Bits16 sixteen_pixels(const std::uint8_t* bgr, const RowTables& tables, int u) {
  cv::v_uint8x16 channel[3];
  cv::v_load_deinterleave(bgr + 3 * u, channel[0], channel[1], channel[2]);
  cv::v_uint8x16 below = cv::v_setzero_u8(), above = cv::v_setzero_u8();
  for (int c = 0; c < 3; ++c) {  // saturating subtraction: zero unless the level is out of bounds
    below = below | (cv::v_load(tables.low[c] + u) - channel[c]);
    above = above | (channel[c] - cv::v_load(tables.high[c] + u));
  }
  const cv::v_uint8x16 zero = cv::v_setzero_u8();
  const auto differs = std::uint64_t(cv::v_signmask((below | above) != zero));
  return {differs, differs & std::uint64_t(cv::v_signmask(above == zero))};
}

}  // namespace

DifferenceTables difference_tables(const ReferenceImage& reference, double sigmas,
                                   double floor_levels) {
  const std::size_t pixels = std::size_t(reference.width_px) * reference.height_px;
  DifferenceTables tables{reference.width_px, reference.height_px, {}, {}};
  for (int c = 0; c < 3; ++c) {
    tables.low[c].resize(pixels);
    tables.high[c].resize(pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
      const double mean = reference.mean_levels[3 * i + c];
      const double tolerance_levels =
          std::max(floor_levels, sigmas * reference.sigma_levels[3 * i + c]);
      tables.low[c][i] = std::uint8_t(std::clamp(std::ceil(mean - tolerance_levels), 0.0, 255.0));
      tables.high[c][i] = std::uint8_t(std::clamp(std::floor(mean + tolerance_levels), 0.0, 255.0));
    }
  }
  return tables;
}

Difference difference(const cv::Mat& image_bgr, const DifferenceTables& tables) {
  assert(image_bgr.type() == CV_8UC3 && image_bgr.cols == tables.width_px &&
         image_bgr.rows == tables.height_px);
  const int width = tables.width_px;
  Difference result{hull::ObjectPixels(width, tables.height_px),
                    hull::ObjectPixels(width, tables.height_px)};
  const std::size_t words = std::size_t(result.differs.words_per_row());
  for (int v = 0; v < tables.height_px; ++v) {
    RowTables row;
    for (int c = 0; c < 3; ++c) {
      row.low[c] = tables.low[c].data() + std::size_t(v) * width;
      row.high[c] = tables.high[c].data() + std::size_t(v) * width;
    }
    const std::uint8_t* bgr = image_bgr.ptr(v);
    std::uint64_t* differs = result.differs.mutable_words().data() + v * words;
    std::uint64_t* darker = result.darker.mutable_words().data() + v * words;
    const auto put = [&](int u, Bits16 bits, int shift) {
      differs[u >> 6] |= (bits.differs >> shift) << (u & 63);
      darker[u >> 6] |= (bits.darker >> shift) << (u & 63);
    };
    int u = 0;
    for (; u + 16 <= width; u += 16) put(u, sixteen_pixels(bgr, row, u), 0);
    if (u == width) continue;
    if (width >= 16) {  // the last 16 pixels; the shift drops those already done
      put(u, sixteen_pixels(bgr, row, width - 16), u - (width - 16));
      continue;
    }
    // The image is narrower than 16 pixels: uses copies padded with zeros, which equal the scene.
    std::array<std::uint8_t, 48> padded{};
    std::array<std::array<std::uint8_t, 16>, 6> levels{};
    std::copy(bgr, bgr + 3 * width, padded.begin());
    RowTables copies;
    for (int c = 0; c < 3; ++c) {
      std::copy(row.low[c], row.low[c] + width, levels[c].begin());
      std::copy(row.high[c], row.high[c] + width, levels[3 + c].begin());
      copies.low[c] = levels[c].data();
      copies.high[c] = levels[3 + c].data();
    }
    put(0, sixteen_pixels(padded.data(), copies, 0), 0);
  }
  return result;
}

}  // namespace fivepipe::capture
