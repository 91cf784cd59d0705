#include "capture_node/segmentation/segmentation.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

#include "capture_node/segmentation/bit_morphology.h"

namespace fivepipe::capture {

Segmenter::Segmenter(const config::RigCamera& camera, const ReferenceImage& reference,
                     const config::SegmentationConfig& config)
    : config_(config),
      tables_(difference_tables(reference, config.threshold_sigmas, config.threshold_floor_levels)),
      reference_bgr_(reference.height_px, reference.width_px, CV_8UC3),
      undistortion_(camera),
      outside_published_(outside_published(camera)) {
  assert(reference.width_px == camera.source.width_px &&
         reference.height_px == camera.source.height_px);
  std::transform(
      reference.mean_levels.begin(), reference.mean_levels.end(), reference_bgr_.data,
      [](float level) { return std::uint8_t(std::clamp(std::lround(level), 0L, 255L)); });
}

std::optional<hull::ObjectPixels> Segmenter::segment_captured(const cv::Mat& source_bgr) const {
  if (source_bgr.type() != CV_8UC3 || source_bgr.cols != tables_.width_px ||
      source_bgr.rows != tables_.height_px)
    return std::nullopt;
  Difference found = difference(source_bgr, tables_);
  if (config_.shadow_min_brightness < 1) remove_shadow(source_bgr, found);
  hull::ObjectPixels pixels = opened(std::move(found.differs), config_.opening_px);
  return closed(std::move(pixels), config_.closing_px);
}

std::optional<hull::ObjectPixels> Segmenter::segment(const cv::Mat& source_bgr) const {
  const std::optional<hull::ObjectPixels> captured = segment_captured(source_bgr);
  return captured ? std::optional(undistortion_.published(*captured)) : std::nullopt;
}

void Segmenter::remove_shadow(const cv::Mat& source_bgr, Difference& found) const {
  const std::size_t words = std::size_t(found.differs.words_per_row());
  for (int v = 0; v < tables_.height_px; ++v)
    for (std::size_t w = 0; w < words; ++w) {
      std::uint64_t shadow = 0;
      for (std::uint64_t rest = found.darker.words()[v * words + w]; rest != 0; rest &= rest - 1) {
        const int bit = std::countr_zero(rest);
        const std::size_t u = 64 * w + std::size_t(bit);
        shadow |= std::uint64_t(is_shadow(source_bgr.ptr(v) + 3 * u, reference_bgr_.ptr(v) + 3 * u,
                                          config_.shadow_min_brightness))
                  << bit;
      }
      found.differs.mutable_words()[v * words + w] &= ~shadow;
    }
}

bool is_shadow(const std::uint8_t* pixel_bgr, const std::uint8_t* reference_bgr,
               double min_brightness) {
  int xr = 0, rr = 0, xx = 0;
  for (int c = 0; c < 3; ++c) {
    xr += pixel_bgr[c] * reference_bgr[c];
    rr += reference_bgr[c] * reference_bgr[c];
    xx += pixel_bgr[c] * pixel_bgr[c];
  }
  if (!(float(xr) >= float(min_brightness) * float(rr))) return false;
  const float along = rr > 0 ? float(xr) / float(rr) * float(xr) : 0.0f;  // (s|r|)^2
  const float max_squared_distortion =
      std::max(kShadowColour_levels * kShadowColour_levels,
               kShadowColourFraction * kShadowColourFraction * along);
  return float(xx) - along <= max_squared_distortion;
}

std::size_t Segmenter::count_outside_published(const hull::ObjectPixels& captured) const {
  std::size_t count = 0;
  for (std::size_t i = 0; i < captured.words().size(); ++i)
    count += std::size_t(std::popcount(captured.words()[i] & outside_published_.words()[i]));
  return count;
}

std::vector<std::string> segmentation_diagnostics(const hull::ObjectPixels& pixels,
                                                  std::size_t outside_published) {
  const std::size_t all = std::size_t(pixels.width_px()) * std::size_t(pixels.height_px());
  const std::size_t set = pixels.count();
  if (set == 0) return {"no object pixels: the hull is empty"};
  if (double(set) > kMaxPlausibleFraction * double(all))
    return {std::to_string(100 * set / all) +
            " % of the image are object pixels: check exposure, light and camera position, then "
            "restart the node"};
  // Without a number, which would be another text in each frame.
  if (outside_published > 0)
    return {
        "object pixels are outside the published image, so the hull is cut: in the rig, enlarge "
        "or remove `published` of the camera"};
  return {};
}

}  // namespace fivepipe::capture
