#include "common/hull/silhouette/border_distance.h"

#include <algorithm>

#include "common/hull/silhouette/border_distance_simd.h"

namespace fivepipe::hull {
namespace {

using Squares = std::vector<std::int16_t>;
static_assert(2 * (kMaxInside_px + 1) * (kMaxInside_px + 1) < 32768, "sums of squares fit");

// Squared distances along the rows from each pixel of a region to the nearest pixel of the other
// kind, at most bound_px squared. Zero at pixels of that kind.
struct RowSquares {
  Squares to_outside, to_inside;
};

// Writes the squared distances of the pixels [begin, end) of a row, all of one kind. has_before,
// has_after: the neighbour exists and is of the other kind.
void write_run(std::int16_t* row, int begin, int end, bool has_before, bool has_after,
               int bound_px) {
  for (int i = begin; i < end; ++i) {
    const int before_px = has_before ? i - begin + 1 : bound_px,
              after_px = has_after ? end - i : bound_px;
    const int nearest_px = std::min({before_px, after_px, bound_px});
    row[i] = std::int16_t(nearest_px * nearest_px);
  }
}

RowSquares along_rows(const ObjectPixels& pixels, const PixelRect& region, int inside_px,
                      int outside_px) {
  RowSquares squares{Squares(region.area_px()), Squares(region.area_px())};
  const int width_px = region.width_px();
  const PixelRect image{0, 0, pixels.width_px(), pixels.height_px()};
  for (int v = region.v0_px; v < region.v1_px; ++v) {
    const auto first = std::size_t(v - region.v0_px) * std::size_t(width_px);
    std::int16_t* const to_outside = squares.to_outside.data() + first;
    std::int16_t* const to_inside = squares.to_inside.data() + first;
    int gap_begin = 0;
    pixels.for_each_run(intersection(image, {region.u0_px, v, region.u1_px, v + 1}),
                        [&](int, int u0_px, int u1_px) {
                          const int begin = u0_px - region.u0_px, end = u1_px - region.u0_px;
                          write_run(to_inside, gap_begin, begin, gap_begin > 0, true, outside_px);
                          // The region is wider than the object on both sides.
                          write_run(to_outside, begin, end, true, true, inside_px);
                          gap_begin = end;
                        });
    write_run(to_inside, gap_begin, width_px, gap_begin > 0, false, outside_px);
  }
  return squares;
}

}  // namespace

BorderDistance::BorderDistance(const ObjectPixels& pixels) {
  const PixelRect bounds = pixels.bounds();
  if (bounds.empty()) return;
  // at() interpolates, and reads a pixel beyond kMaxOutside_px.
  constexpr int kMargin_px = kMaxOutside_px + 1;
  region_ = {bounds.u0_px - kMargin_px, bounds.v0_px - kMargin_px, bounds.u1_px + kMargin_px,
             bounds.v1_px + kMargin_px};
  const RowSquares rows = along_rows(pixels, region_, kMaxInside_px, kMargin_px);
  distance_px_.resize(region_.area_px());
  border_distances({rows.to_outside, rows.to_inside, region_.width_px(), kMaxInside_px, kMargin_px},
                   distance_px_);
}

double BorderDistance::between(double u, double v) const {
  const auto column = std::size_t(u), row = std::size_t(v);
  const double fu = u - double(column), fv = v - double(row);
  const auto width = std::size_t(region_.width_px());
  const float* const first = distance_px_.data() + row * width + column;
  const float* const below = first + width;
  return (1 - fv) * ((1 - fu) * double(first[0]) + fu * double(first[1])) +
         fv * ((1 - fu) * double(below[0]) + fu * double(below[1]));
}

double BorderDistance::clamped(double u_px, double v_px) const {
  // Below the last pixel's centre, so that between() reads no pixel beyond it.
  constexpr double kBelow_px = 1e-3;
  return between(std::clamp(u_px - region_.u0_px, 0.0, region_.width_px() - 1 - kBelow_px),
                 std::clamp(v_px - region_.v0_px, 0.0, region_.height_px() - 1 - kBelow_px));
}

std::optional<double> BorderDistance::at(const Eigen::Vector2d& uv_px) const {
  const double u = uv_px.x() - region_.u0_px, v = uv_px.y() - region_.v0_px;
  if (!(u >= 0 && u < region_.width_px() - 1 && v >= 0 && v < region_.height_px() - 1))
    return std::nullopt;
  const double distance_px = between(u, v);
  return distance_px >= -kMaxOutside_px ? std::optional(distance_px) : std::nullopt;
}

Eigen::Vector2d BorderDistance::gradient(const Eigen::Vector2d& uv_px) const {
  const double u = uv_px.x(), v = uv_px.y();
  return Eigen::Vector2d(clamped(u + kGradient_px, v) - clamped(u - kGradient_px, v),
                         clamped(u, v + kGradient_px) - clamped(u, v - kGradient_px)) /
         (2 * kGradient_px);
}

}  // namespace fivepipe::hull
