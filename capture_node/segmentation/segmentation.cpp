#include "capture_node/segmentation/segmentation.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "capture_node/segmentation/bit_morphology.h"
#include "capture_node/segmentation/components.h"
#include "capture_node/segmentation/coverage_estimate.h"

namespace fivepipe::capture {
namespace {

bool any(const hull::ObjectPixels& pixels) {
  return std::any_of(pixels.words().begin(), pixels.words().end(),
                     [](std::uint64_t word) { return word != 0; });
}

GainEstimator gain_estimator(const Background& background) {
  std::vector<cv::Point> positions = gain_grid(background.width_px, background.height_px);
  std::erase_if(positions, [&](const cv::Point& at) {
    const int index = at.y * background.width_px + at.x;
    return std::binary_search(
        background.moving.begin(), background.moving.end(), MovingPixel{index, {}},
        [](const MovingPixel& a, const MovingPixel& b) { return a.index < b.index; });
  });
  std::vector<Levels> levels;
  for (const cv::Point& at : positions) {
    const float* level =
        &background.mean_levels[3 * (std::size_t(at.y) * background.width_px + at.x)];
    levels.push_back({level[0], level[1], level[2]});
  }
  return GainEstimator(positions, levels);
}

}  // namespace

LearningSettings learning_settings(const config::SegmentationConfig& config) {
  if (config.conservative) return {false, config.threshold_ceiling_levels, 0};
  return {config.gain_compensation, config.threshold_ceiling_levels, config.moving_boxes};
}

Tolerances tolerances(const config::SegmentationConfig& config) {
  return {config.threshold_sigmas, config.threshold_floor_levels, config.threshold_ceiling_levels,
          config.conservative ? 0 : config.jitter_px, config.hysteresis};
}

Segmenter::Segmenter(Background background, const config::SegmentationConfig& config,
                     std::optional<hull::ObjectPixels> within)
    : config_(config),
      background_(std::move(background)),
      tables_(difference_tables(background_, tolerances(config))),
      within_(std::move(within)) {
  assert(!within_ || (within_->width_px() == background_.width_px &&
                      within_->height_px() == background_.height_px));
  if (config.gain_compensation && !config.conservative)
    gain_estimator_ = gain_estimator(background_);
  brighter_.assign(std::size_t(background_.height_px), {1, 1, 1});
}

std::optional<Segmentation> Segmenter::segment(const cv::Mat& image_bgr) {
  if (image_bgr.type() != CV_8UC3 || image_bgr.cols != tables_.width_px ||
      image_bgr.rows != tables_.height_px)
    return std::nullopt;
  Segmentation result;
  const Gain gain = gain_estimator_ ? gain_estimator_->gain(image_bgr) : Gain{1, 1, 1};
  result.gain = visible(gain);
  const InverseGain inverse_gain = inverse_of(result.gain);
  result.difference =
      difference(image_bgr, tables_,
                 {inverse_gain, config_.conservative ? 1.0 : config_.shadow_min_brightness,
                  config_.shadow_tint_degrees, within_ ? &*within_ : nullptr});
  result.object =
      config_.conservative ? result.difference.differs : object_pixels(result.difference);
  if (config_.closing_px > 0) result.object = closed(std::move(result.object), config_.closing_px);
  if (config_.max_hole_px > 0)
    result.object = with_holes_filled(result.object, config_.max_hole_px);
  if (within_) result.object.keep(*within_);
  if (config_.adaptation_s > 0 && !config_.conservative) adapt(image_bgr, gain, result.object);
  return result;
}

hull::CoverageMap Segmenter::coverage(const cv::Mat& image_bgr, const Segmentation& of) const {
  const Eigen::Vector3f gain = Eigen::Vector3d::Map(of.gain.data()).cast<float>();
  return estimated_coverage(image_bgr, of.object, {background_.mean_levels, gain});
}

hull::ObjectPixels Segmenter::object_pixels(const Difference& difference) const {
  hull::ObjectPixels seeds = difference.strongly;
  hull::ObjectPixels pixels = with_neighbours(difference.differs, kMajority);
  pixels.keep(difference.differs);
  pixels.add(seeds);
  if (any(difference.shadow)) {
    hull::ObjectPixels others = difference.differs;
    others.remove(difference.shadow);
    hull::ObjectPixels shaded = difference.shadow;
    shaded.remove(with_neighbours(others, kObjectNeighbours));
    hull::ObjectPixels lonely = dilated(difference.shadow, 1);
    lonely.remove(difference.shadow);
    lonely.remove(with_neighbours(others, kShadowNeighbours));
    shaded.add(lonely);
    pixels.remove(shaded);
    seeds.remove(shaded);
  }
  if (config_.opening_px > 0) pixels = opened(std::move(pixels), config_.opening_px);
  return seeded_components(pixels, seeds, config_.min_object_px);
}

void Segmenter::adapt(const cv::Mat& image_bgr, const Gain& gain,
                      const hull::ObjectPixels& object) {
  const hull::ObjectPixels near = dilated(object, kAdaptationMargin_px);
  const double rate = -std::expm1(-kAdaptationRows * period_s_ / config_.adaptation_s);
  Gain brighter;
  for (std::size_t c = 0; c < 3; ++c)
    brighter[c] = 1 + std::clamp(rate * (gain[c] - 1), -kMaxGainStep, kMaxGainStep);
  for (int v = next_row_; v < tables_.height_px; v += kAdaptationRows) {
    for (int u = 0; u < tables_.width_px; ++u) {
      const bool is_near = near.contains(u, v);
      for (std::size_t c = 0; c < 3; ++c) {
        float& mean = background_.mean_levels[3 * (std::size_t(v) * tables_.width_px + u) + c];
        // Not rounded: a small gain would remain in each level, and count twice.
        const double level = image_bgr.ptr(v)[3 * u + int(c)] / gain[c];
        if (!is_near) mean += float(rate * (level - mean));
        // The brightness of the whole image also changes what an object hides.
        mean = float(std::min(255.0, mean * brighter[c]));
      }
    }
    Gain& of_row = brighter_[std::size_t(v)];
    for (std::size_t c = 0; c < 3; ++c) of_row[c] *= brighter[c];
    refill_row(tables_, background_, tolerances(config_), v, of_row);
  }
  next_row_ = (next_row_ + 1) % kAdaptationRows;
  if (next_row_ == 0 && gain_estimator_) gain_estimator_ = gain_estimator(background_);
}

std::vector<std::string> segmentation_diagnostics(const hull::ObjectPixels& pixels,
                                                  std::size_t outside_published,
                                                  hull::Limits limits) {
  const std::size_t all = std::size_t(pixels.width_px()) * std::size_t(pixels.height_px());
  const std::size_t set = pixels.count();
  // Without numbers, which would be another text in each frame.
  if (outside_published > 0)
    return {
        "object pixels are outside the published image, so the hull is cut: in the rig, enlarge "
        "or remove `published` of the camera"};
  if (set == 0 && limits == hull::Limits::all) return {"no object pixels: the hull is empty"};
  if (double(set) > kMaxPlausibleFraction * double(all))
    return {"more than " + std::to_string(std::lround(100 * kMaxPlausibleFraction)) +
            " % of the image are object pixels: check exposure, light and camera position, then "
            "restart the node"};
  return {};
}

}  // namespace fivepipe::capture
