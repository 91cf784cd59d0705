#include "common/hull/silhouette/coverage_walk.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

namespace fivepipe::hull {
namespace {

// An image this close to a cell's border counts as on it [px]: 1000 times the rounding in an image
// of 10,000 px.
constexpr double kOnBorder_px = 1e-8;

// Keeps the part of the range with offset + t * slope >= 0.
void clip(RayRange& range, double offset, double slope) {
  const bool in_at_begin = offset + range.begin * slope >= 0,
             in_at_end = offset + range.end * slope >= 0;
  if (in_at_begin && in_at_end) return;
  if (in_at_end)
    range.begin = std::max(range.begin, -offset / slope);
  else if (in_at_begin)
    range.end = std::min(range.end, -offset / slope);
  else
    range.end = range.begin;
}

// Returns the part of the range in front of the camera and inside the image, whose border is half a
// cell inside the outer border of the cells.
RayRange within_image(const ImageLine& l, const CoverageMap& map, RayRange range) {
  clip(range, l.w_offset - kNearestToCamera_m, l.w_slope);
  const auto axis = [&](double offset, double slope, int size_px) {
    const double low = 0.5, high = size_px + 0.5;
    clip(range, offset - low * l.w_offset, slope - low * l.w_slope);
    clip(range, high * l.w_offset - offset, high * l.w_slope - slope);
  };
  axis(l.u_offset, l.u_slope, map.width_px());
  axis(l.v_offset, l.v_slope, map.height_px());
  return range;
}

int floored(double x, int max) { return !(x > 0) ? 0 : x >= max ? max : int(std::floor(x)); }

// Returns the parameter >= t at which the image crosses `border` of one axis: t if it is on the
// border already, kNever if it has passed it.
double crossing(double offset, double slope, double w_offset, double w_slope, int border,
                double t) {
  const double at = border_crossing(offset, slope, w_offset, w_slope, border);
  if (at > t) return at;
  const double w = w_offset + t * w_slope;
  return std::abs(offset + t * slope - border * w) <= kOnBorder_px * w ? t : kNever;
}

}  // namespace

geometry::Camera cell_camera(const geometry::Camera& camera) {
  geometry::Camera cells = camera;
  ++cells.pinhole.width_px;
  ++cells.pinhole.height_px;
  cells.pinhole.cx_px += 0.5;
  cells.pinhole.cy_px += 0.5;
  return cells;
}

namespace {

// Sets bit i of `bits` for each byte of the row at or above one half.
void half_covered(std::span<const std::uint8_t> row, std::span<std::uint64_t> bits) {
  static_assert(side_of_border(128) > 0 && side_of_border(127) < 0, "the highest bit decides");
  std::fill(bits.begin(), bits.end(), 0);
  std::size_t u = 0;
  for (; u + 8 <= row.size(); u += 8) {
    std::uint64_t bytes;
    std::memcpy(&bytes, row.data() + u, 8);
    // The highest bits of the eight bytes, the first one in bit 0 (little endian).
    const std::uint64_t of_eight = (bytes & 0x8080808080808080u) * 0x0002040810204081u >> 56;
    bits[u / 64] |= of_eight << (u % 64);
  }
  for (; u < row.size(); ++u) bits[u / 64] |= std::uint64_t(row[u] >> 7) << (u % 64);
}

}  // namespace

// Pixel (u, v) is a corner of the cells (u, v) to (u + 1, v + 1). The outermost cells have the
// outermost pixels twice (CoverageMap::at_nearest()).
CellsOfMap cells_of(const CoverageMap& map) {
  const int width = map.width_px(), height = map.height_px();
  CellsOfMap cells{ObjectPixels(width + 1, height + 1), ObjectPixels(width + 1, height + 1)};
  if (width == 0 || height == 0) return cells;
  const auto words = std::size_t(cells.any.words_per_row());
  std::vector<std::uint64_t> pixels(words), any_before, all_before, any_here(words),
      all_here(words);
  for (int v = 0; v <= height; ++v) {
    if (v < height) {
      half_covered(map.bytes().subspan(std::size_t(v) * std::size_t(width), std::size_t(width)),
                   pixels);
      const std::uint64_t first = pixels[0] & 1;
      const std::uint64_t last = (pixels[std::size_t(width - 1) / 64] >> ((width - 1) % 64) & 1)
                                 << (width % 64);
      for (std::size_t w = 0; w < words; ++w) {
        const std::uint64_t left = pixels[w] << 1 | (w == 0 ? 0 : pixels[w - 1] >> 63);
        any_here[w] = pixels[w] | left;
        // Beside the image the nearest pixel counts.
        const std::uint64_t to_right = pixels[w] | (w == std::size_t(width) / 64 ? last : 0),
                            to_left = left | (w == 0 ? first : 0);
        all_here[w] = to_right & to_left;
      }
    }
    if (v == 0) {
      any_before = any_here;
      all_before = all_here;
    }
    const std::size_t row = std::size_t(v) * words;
    for (std::size_t w = 0; w < words; ++w) {
      cells.any.mutable_words()[row + w] = any_before[w] | any_here[w];
      cells.all.mutable_words()[row + w] = all_before[w] & all_here[w];
    }
    any_before = any_here;
    all_before = all_here;
  }
  return cells;
}

CoverageWalk::CoverageWalk(const ImageLine& line, const CoverageMap& map, const SkipMap& skip_map,
                           const RayRange& range)
    : line_(line),
      map_(&map),
      skip_map_(&skip_map),
      inside_image_(within_image(line, map, range)),
      right_(line.u_slope * line.w_offset > line.u_offset * line.w_slope),
      down_(line.v_slope * line.w_offset > line.v_offset * line.w_slope),
      verdict_span_{false, inside_image_.empty() ? kNever : inside_image_.begin} {}

CoverageWalk::ImagePoint CoverageWalk::at(double t) const {
  const double w = line_.w_offset + t * line_.w_slope;
  return {(line_.u_offset + t * line_.u_slope) / w, (line_.v_offset + t * line_.v_slope) / w, w};
}

void CoverageWalk::walk_to(double t) {
  if (!(t < inside_image_.end)) {
    verdict_span_ = {false, kNever};
  } else if (cuts_ > 0 && t < cut_t_[cuts_ - 1]) {
    select_piece(t);
  } else if (t == leaves_box_) {
    step_over_border(t);
  } else {
    const ImagePoint p = at(t);
    u_ = floored(p.u, map_->width_px());
    v_ = floored(p.v, map_->height_px());
    enter(t);
  }
}

// Steps across the box's border by index, because the rounded position may be on either side.
void CoverageWalk::step_over_border(double t) {
  const ImagePoint p = at(t);
  if (leaves_by_u_) {
    u_ = right_ ? box_.u1_px : box_.u0_px - 1;
    v_ = std::clamp(floored(p.v, map_->height_px()), box_.v0_px, box_.v1_px - 1);
  } else {
    v_ = down_ ? box_.v1_px : box_.v0_px - 1;
    u_ = std::clamp(floored(p.u, map_->width_px()), box_.u0_px, box_.u1_px - 1);
  }
  if (u_ < 0 || v_ < 0 || u_ > map_->width_px() || v_ > map_->height_px()) {
    inside_image_.end = t;
    verdict_span_ = {false, kNever};
  } else {
    enter(t);
  }
}

void CoverageWalk::enter(double t) {
  const Quadrant ahead = quadrant_ahead(!right_, !down_);
  const int extent = skip_map_->at(ahead, u_, v_);
  box_ = quadrant_rect(ahead, u_, v_, std::max(extent, 1));
  const double at_u = crossing(line_.u_offset, line_.u_slope, line_.w_offset, line_.w_slope,
                               right_ ? box_.u1_px : box_.u0_px, t);
  const double at_v = crossing(line_.v_offset, line_.v_slope, line_.w_offset, line_.w_slope,
                               down_ ? box_.v1_px : box_.v0_px, t);
  leaves_by_u_ = at_u <= at_v;
  leaves_box_ = std::min(at_u, at_v);
  cuts_ = 0;
  if (extent > 0 || leaves_box_ == t)
    verdict_span_ = {false, leaves_box_};
  else
    cut_cell(t);
}

// Cuts the ray's part in a cell at the roots of the quadratic. If the ray enters the cell at t0
// with image p0 and leaves it at t1 with image p1, p0 + x (p1 - p0) is the image of the parameter
// t0 + (t1 - t0) x w0 / ((1 - x) w1 + x w0).
void CoverageWalk::cut_cell(double t) {
  const double s00 = side_of_border(map_->at_nearest(u_ - 1, v_ - 1)),
               s10 = side_of_border(map_->at_nearest(u_, v_ - 1));
  const double s01 = side_of_border(map_->at_nearest(u_ - 1, v_)),
               s11 = side_of_border(map_->at_nearest(u_, v_));
  const double end = std::min(leaves_box_, inside_image_.end);
  if (s00 > 0 && s10 > 0 && s01 > 0 && s11 > 0) {
    verdict_span_ = {true, end};
    return;
  }
  const ImagePoint p0 = at(t), p1 = at(end);
  const double x = p0.u - u_, y = p0.v - v_, dx = p1.u - p0.u, dy = p1.v - p0.v, by_u = s10 - s00,
               by_v = s01 - s00, by_uv = s00 - s10 - s01 + s11;
  constant_ = s00 + by_u * x + by_v * y + by_uv * x * y;
  linear_ = by_u * dx + by_v * dy + by_uv * (x * dy + y * dx);
  square_ = by_uv * dx * dy;
  cut_at_[0] = 0;
  cut_t_[0] = t;
  cuts_ = 1;
  const double discriminant = linear_ * linear_ - 4 * square_ * constant_;
  const double q =
      -0.5 * (linear_ + std::copysign(std::sqrt(std::max(discriminant, 0.0)), linear_));
  double roots[2] = {q / square_, constant_ / q};
  if (roots[0] > roots[1]) std::swap(roots[0], roots[1]);
  for (const double root : roots)
    if (discriminant > 0 && root > 0 && root < 1) {
      cut_at_[cuts_] = root;
      cut_t_[cuts_++] = t + (end - t) * (root * p0.w / ((1 - root) * p1.w + root * p0.w));
    }
  cut_at_[cuts_] = 1;
  cut_t_[cuts_++] = end;
  select_piece(t);
}

// Takes the sign at the center of the piece, because at its ends only rounding decides.
void CoverageWalk::select_piece(double t) {
  int piece = 0;
  while (piece + 2 < cuts_ && !(t < cut_t_[piece + 1])) ++piece;
  const double x = 0.5 * (cut_at_[piece] + cut_at_[piece + 1]);
  verdict_span_ = {constant_ + x * (linear_ + x * square_) >= 0, cut_t_[piece + 1]};
}

}  // namespace fivepipe::hull
