#include "capture_node/lens/undistortion.h"

#include <cassert>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace fivepipe::capture {

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
  source_index_.assign(std::size_t(width_px_) * height_px_, kUnseen);
  source_rects_.assign(std::size_t(words) * height_px_,
                       {source_width_px_, source_height_px_, 0, 0});
  cv::Mat map(height_px_, width_px_, CV_32FC2, cv::Scalar::all(-10));  // outside the image
  for (int v = 0; v < height_px_; ++v)
    for (int u = 0; u < width_px_; ++u) {
      const Eigen::Vector2d xy((u - to.cx_px) / to.fx_px, (v - to.cy_px) / to.fy_px);
      if (xy.norm() >= radius) continue;
      const Eigen::Vector2d lens = geometry::distorted(camera.distortion, xy);
      const double su = lens.x() * from.fx_px + from.cx_px, sv = lens.y() * from.fy_px + from.cy_px;
      if (!(su >= -0.5 && sv >= -0.5 && su < source_width_px_ - 0.5 &&
            sv < source_height_px_ - 0.5))
        continue;
      const int iu = int(std::floor(su + 0.5)), iv = int(std::floor(sv + 0.5));
      source_index_[std::size_t(v) * width_px_ + u] = iv * source_row_bits + iu;
      SourceRect& rect_of_word = source_rects_[std::size_t(v) * words + (u >> 6)];
      rect_of_word = {std::min(rect_of_word.u0, iu), std::min(rect_of_word.v0, iv),
                      std::max(rect_of_word.u1, iu + 1), std::max(rect_of_word.v1, iv + 1)};
      map.at<cv::Vec2f>(v, u) = {float(su), float(sv)};
    }
  cv::convertMaps(map, cv::noArray(), position_, fraction_, CV_16SC2);
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
  return identity_ || source_index_[std::size_t(v_px) * width_px_ + u_px] != kUnseen;
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
      const std::int32_t* index = source_index_.data() + std::size_t(v) * width_px_ + 64 * w;
      const int n = std::min(64, width_px_ - 64 * w);
      std::uint64_t word = 0;
      for (int i = 0; i < n; ++i)
        if (index[i] != kUnseen) word |= (bits[index[i] >> 6] >> (index[i] & 63) & 1) << i;
      result.mutable_words()[std::size_t(v) * words + w] = word;
    }
  return result;
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
