#include "capture_node/lens/undistortion.h"

#include <bit>
#include <cassert>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace fivepipe::capture {

namespace {

// Whether some and all pixels of a rectangle are set.
struct Contents {
  bool any, all;
};

Contents contents_of(const hull::ObjectPixels& pixels, int u0, int v0, int u1, int v1) {
  const auto row_words = std::size_t(pixels.words_per_row());
  const int first = u0 >> 6, last = (u1 - 1) >> 6;
  std::uint64_t set = 0, unset = 0;
  for (int w = first; w <= last; ++w) {
    std::uint64_t mask = ~std::uint64_t(0);
    if (w == first) mask &= ~std::uint64_t(0) << (u0 & 63);
    if (w == last) mask &= ~std::uint64_t(0) >> (63 - ((u1 - 1) & 63));
    const std::uint64_t* word = pixels.words().data() + std::size_t(v0) * row_words + w;
    for (int v = v0; v < v1; ++v, word += row_words) {
      set |= *word & mask;
      unset |= ~*word & mask;
    }
  }
  return {set != 0, unset == 0};
}

// Returns `count` (1 to 64) bits of one row, from bit `first` on.
std::uint64_t bits_of(const std::uint64_t* words, std::int32_t first, int count) {
  const std::uint64_t* const word = words + (first >> 6);
  const int shift = first & 63;
  std::uint64_t bits = word[0] >> shift;
  if (shift + count > 64) bits |= word[1] << (64 - shift);
  return count == 64 ? bits : bits & ((std::uint64_t(1) << count) - 1);
}

}  // namespace

Undistortion::Undistortion(const config::RigCamera& camera)
    : identity_(camera.distortion.none() && camera.source == camera.published),
      source_width_px_(camera.source.width_px),
      source_height_px_(camera.source.height_px),
      width_px_(camera.published.width_px),
      height_px_(camera.published.height_px) {
  if (identity_) return;
  const geometry::Pinhole &from = camera.source, &to = camera.published;
  const double radius = geometry::monotonic_radius(camera.distortion);
  const int words = (width_px_ + 63) / 64, source_row_bits = (source_width_px_ + 63) / 64 * 64;
  run_ends_.assign(std::size_t(words) * height_px_, 0);
  source_rects_.assign(std::size_t(words) * height_px_,
                       {source_width_px_, source_height_px_, 0, 0});
  seen_.assign(std::size_t(words) * height_px_, 0);
  cv::Mat map(height_px_, width_px_, CV_32FC2, cv::Scalar::all(-10));  // outside the image
  for (int v = 0; v < height_px_; ++v)
    for (int u = 0; u < width_px_; ++u) {
      const std::size_t word = std::size_t(v) * words + (u >> 6);
      if (u % 64 == 0) run_ends_[word] = std::uint32_t(runs_.size());
      const Eigen::Vector2d xy((u - to.cx_px) / to.fx_px, (v - to.cy_px) / to.fy_px);
      if (xy.norm() >= radius) continue;
      const Eigen::Vector2d lens = geometry::distorted(camera.distortion, xy);
      const double su = lens.x() * from.fx_px + from.cx_px, sv = lens.y() * from.fy_px + from.cy_px;
      if (!(su >= -0.5 && sv >= -0.5 && su < source_width_px_ - 0.5 &&
            sv < source_height_px_ - 0.5))
        continue;
      const int iu = int(std::floor(su + 0.5)), iv = int(std::floor(sv + 0.5));
      add_bit(word, u & 63, iv * source_row_bits + iu);
      seen_[word] |= std::uint64_t(1) << (u & 63);
      SourceRect& rect_of_word = source_rects_[word];
      rect_of_word = {std::min(rect_of_word.u0, iu), std::min(rect_of_word.v0, iv),
                      std::max(rect_of_word.u1, iu + 1), std::max(rect_of_word.v1, iv + 1)};
      map.at<cv::Vec2f>(v, u) = {float(su), float(sv)};
    }
  cv::convertMaps(map, cv::noArray(), position_, fraction_, CV_16SC2);
}

void Undistortion::add_bit(std::size_t word, int u, std::int32_t source_bit) {
  const bool has_runs = run_ends_[word] > (word > 0 ? run_ends_[word - 1] : 0);
  if (has_runs && runs_.back().begin + runs_.back().length == u &&
      runs_.back().source_bit + runs_.back().length == source_bit)
    ++runs_.back().length;
  else
    runs_.push_back({source_bit, std::uint8_t(u), 1});
  run_ends_[word] = std::uint32_t(runs_.size());
}

hull::ObjectPixels outside_published(const config::RigCamera& camera) {
  const geometry::Pinhole &from = camera.source, &to = camera.published;
  hull::ObjectPixels outside(from.width_px, from.height_px);
  if (to == geometry::whole_pinhole(from, camera.distortion)) return outside;
  constexpr double kConverged_px = 0.5;
  const double radius = geometry::monotonic_radius(camera.distortion);
  for (int v = 0; v < from.height_px; ++v)
    for (int u = 0; u < from.width_px; ++u) {
      const Eigen::Vector2d xy = geometry::undistorted(from, camera.distortion, {u, v}),
                            back = geometry::distorted(camera.distortion, xy);
      const Eigen::Vector2d error_px(back.x() * from.fx_px + from.cx_px - u,
                                     back.y() * from.fy_px + from.cy_px - v);
      if (!(xy.norm() < radius && error_px.norm() < kConverged_px)) continue;
      const double to_u = xy.x() * to.fx_px + to.cx_px, to_v = xy.y() * to.fy_px + to.cy_px;
      outside.set(
          u, v,
          !(to_u >= -0.5 && to_v >= -0.5 && to_u < to.width_px - 0.5 && to_v < to.height_px - 0.5));
    }
  return outside;
}

bool Undistortion::sees(int u_px, int v_px) const {
  return identity_ ||
         (seen_[std::size_t(v_px) * ((width_px_ + 63) / 64) + (u_px >> 6)] >> (u_px & 63) & 1);
}

bool Undistortion::sees_all() const {
  for (int v = 0; v < height_px_; ++v)
    for (int u = 0; u < width_px_; ++u)
      if (!sees(u, v)) return false;
  return true;
}

hull::ObjectPixels Undistortion::published(const hull::ObjectPixels& source) const {
  assert(source.width_px() == source_width_px_ && source.height_px() == source_height_px_);
  if (identity_) return source;
  const hull::PixelRect set_bounds = source.bounds();
  hull::ObjectPixels result(width_px_, height_px_);
  const int words = result.words_per_row();
  const std::uint64_t* bits = source.words().data();
  for (int v = 0; v < height_px_; ++v)
    for (int w = 0; w < words; ++w) {
      const SourceRect& rect_of_word = source_rects_[std::size_t(v) * words + w];
      if (rect_of_word.u0 >= set_bounds.u1_px || rect_of_word.u1 <= set_bounds.u0_px ||
          rect_of_word.v0 >= set_bounds.v1_px || rect_of_word.v1 <= set_bounds.v0_px)
        continue;
      // Most words see only object pixels, or none.
      const Contents contents =
          contents_of(source, rect_of_word.u0, rect_of_word.v0, rect_of_word.u1, rect_of_word.v1);
      if (!contents.any) continue;
      std::uint64_t word = seen_[std::size_t(v) * words + w];
      if (!contents.all) {
        word = 0;
        const std::size_t at = std::size_t(v) * words + w;
        for (std::uint32_t i = at > 0 ? run_ends_[at - 1] : 0; i < run_ends_[at]; ++i)
          word |= bits_of(bits, runs_[i].source_bit, runs_[i].length) << runs_[i].begin;
      }
      result.mutable_words()[std::size_t(v) * words + w] = word;
    }
  return result;
}

hull::CoverageMap Undistortion::published(const hull::CoverageMap& source) const {
  assert(source.width_px() == source_width_px_ && source.height_px() == source_height_px_);
  if (identity_) return source;
  // OpenCV takes no pointer to const, but only reads.
  const cv::Mat bytes(source_height_px_, source_width_px_, CV_8UC1,
                      const_cast<std::uint8_t*>(source.bytes().data()));
  cv::Mat result;
  cv::remap(bytes, result, position_, fraction_, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  for (int v = 0; v < height_px_; ++v)
    for (int u = 0; u < width_px_; ++u)
      if (!sees(u, v)) result.at<std::uint8_t>(v, u) = 0;
  return hull::CoverageMap::from_bytes(width_px_, height_px_,
                                       {result.ptr(), std::size_t(width_px_) * height_px_});
}

cv::Mat Undistortion::published(const cv::Mat& source_bgr, const hull::PixelRect& region) const {
  const cv::Rect rect(region.u0_px, region.v0_px, region.width_px(), region.height_px());
  if (rect.empty()) return {};
  if (identity_) return source_bgr(rect).clone();
  cv::Mat result;
  cv::remap(source_bgr, result, position_(rect), fraction_(rect), cv::INTER_LINEAR,
            cv::BORDER_CONSTANT);
  return result;
}

}  // namespace fivepipe::capture
