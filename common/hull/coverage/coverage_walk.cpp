#include "common/hull/coverage/coverage_walk.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace fivepipe::hull {
namespace {

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
RayRange within_image(const ImageLine& l, const ObjectPixels& cells, RayRange range) {
  clip(range, l.w_offset - kNearestToCamera_m, l.w_slope);
  const auto axis = [&](double offset, double slope, int size_px) {
    const double low = 0.5, high = size_px - 0.5;
    clip(range, offset - low * l.w_offset, slope - low * l.w_slope);
    clip(range, high * l.w_offset - offset, high * l.w_slope - slope);
  };
  axis(l.u_offset, l.u_slope, cells.width_px());
  axis(l.v_offset, l.v_slope, cells.height_px());
  return range;
}

int floored(double x, int max) { return !(x > 0) ? 0 : x >= max ? max : int(x); }

// constant + x (linear + x square): coverage - one half [1/510] by the distance from the entry into
// a cell.
struct Quadratic {
  double constant, linear, square;
  double at(double x) const { return constant + x * (linear + x * square); }
};

// Returns the first x in [0, length] at which the quadratic rises to 0. It begins below 0.
double first_rise(const Quadratic& f, double length) {
  const auto [constant, linear, square] = f;
  const bool has_maximum_inside = linear > 0 && linear + 2 * square * length < 0;
  if (!(f.at(length) > 0) && !has_maximum_inside) return kNever;
  const double discriminant = linear * linear - 4 * square * constant;
  if (!(discriminant > 0)) return kNever;
  const double root = std::sqrt(discriminant);
  return std::min(length,
                  linear > 0 ? -2 * constant / (linear + root) : (root - linear) / (2 * square));
}

// Returns the start of the first piece of [0, length], cut at the roots, in which the quadratic is
// >= 0. It takes the sign at the center of a piece, because at its ends only rounding decides.
double first_positive_piece(const Quadratic& f, double length) {
  const auto [constant, linear, square] = f;
  double cuts[4] = {0};
  int count = 1;
  const double discriminant = linear * linear - 4 * square * constant;
  if (discriminant > 0) {
    const double q = -0.5 * (linear + std::copysign(std::sqrt(discriminant), linear));
    double roots[2] = {q / square, constant / q};
    if (roots[0] > roots[1]) std::swap(roots[0], roots[1]);
    for (const double root : roots)
      if (root > 0 && root < length) cuts[count++] = root;
  }
  cuts[count] = length;
  for (int i = 0; i < count; ++i)
    if (f.at(0.5 * (cuts[i] + cuts[i + 1])) >= 0) return cuts[i];
  return kNever;
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

// Pixel (u, v) is a corner of the cells (u, v) to (u + 1, v + 1). The outermost cells have the
// outermost pixels twice.
CellsOfMap cells_of(const ObjectPixels& half_covered) {
  const int width = half_covered.width_px(), height = half_covered.height_px();
  CellsOfMap cells{ObjectPixels(width + 1, height + 1), ObjectPixels(width + 1, height + 1)};
  if (width == 0 || height == 0) return cells;
  const auto words = std::size_t(cells.any.words_per_row()),
             words_of_pixels = std::size_t(half_covered.words_per_row());
  std::vector<std::uint64_t> any_before, all_before, any_here(words), all_here(words);
  for (int v = 0; v <= height; ++v) {
    if (v < height) {
      const auto pixels =
          half_covered.words().subspan(std::size_t(v) * words_of_pixels, words_of_pixels);
      const std::uint64_t first = pixels[0] & 1;
      const std::uint64_t last = (pixels[std::size_t(width - 1) / 64] >> ((width - 1) % 64) & 1)
                                 << (width % 64);
      for (std::size_t w = 0; w < words; ++w) {
        // A row of cells may have one word more.
        const std::uint64_t here = w < words_of_pixels ? pixels[w] : 0;
        const std::uint64_t left = here << 1 | (w == 0 ? 0 : pixels[w - 1] >> 63);
        any_here[w] = here | left;
        // Beside the image the nearest pixel counts.
        const std::uint64_t to_right = here | (w == std::size_t(width) / 64 ? last : 0),
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

WalkedMap::WalkedMap(const SparseCoverageMap& map, const ObjectPixels& half_covered,
                     ObjectPixels whole)
    : whole_cells(std::move(whole)) {
  const PixelRect object = half_covered.bounds();
  if (object.empty()) return;
  corners = {object.u0_px - 1, object.v0_px - 1, object.u1_px + 1, object.v1_px + 1};
  const PixelRect seen = intersection(corners, {0, 0, map.width_px(), map.height_px()});
  coverage = map.bytes(seen);
  if (seen == corners) return;
  const std::vector<std::uint8_t> inside = std::exchange(coverage, {});
  for (int v = corners.v0_px; v < corners.v1_px; ++v)
    for (int u = corners.u0_px; u < corners.u1_px; ++u) {
      const int column = std::clamp(u, seen.u0_px, seen.u1_px - 1) - seen.u0_px,
                row = std::clamp(v, seen.v0_px, seen.v1_px - 1) - seen.v0_px;
      coverage.push_back(
          inside[std::size_t(row) * std::size_t(seen.width_px()) + std::size_t(column)]);
    }
}

CoverageWalk::CoverageWalk(const MapFromView& map_from_view, const WalkedMap& map,
                           const SkipMap& skip_map)
    : map_from_view_(map_from_view),
      map_(&map),
      skip_map_(&skip_map),
      whole_(map.whole_cells.words().data()),
      words_per_row_(map.whole_cells.words_per_row()),
      end_u_(map.whole_cells.width_px() - 0.5),
      end_v_(map.whole_cells.height_px() - 0.5) {
  line_.u_offset = map_from_view.at_eye.x();
  line_.v_offset = map_from_view.at_eye.y();
  line_.w_offset = map_from_view.at_eye.z();
}

// Requires that p, the image at t, is in the camera's image.
void CoverageWalk::start(double t, const ImagePoint& p) {
  has_started_ = true;
  t0_ = t;
  start_ = p;
  right_ = line_.u_slope * line_.w_offset > line_.u_offset * line_.w_slope;
  down_ = line_.v_slope * line_.w_offset > line_.v_offset * line_.w_slope;
  du_ = p.w * (line_.u_slope - p.u * line_.w_slope);
  dv_ = p.w * (line_.v_slope - p.v * line_.w_slope);
  // If only rounding moves the image, it stays.
  if (right_ != (du_ > 0)) du_ = 0;
  if (down_ != (dv_ > 0)) dv_ = 0;
  per_du_ = 1 / du_;
  per_dv_ = 1 / dv_;
  // The line leaves the image before it reaches the camera's plane, unless the image is a point.
  const double end_w = line_.w_offset + range_.end * line_.w_slope;
  s_end_ = s_of(end_w > kNearestToCamera_m ? range_.end
                                           : (kNearestToCamera_m - line_.w_offset) / line_.w_slope);
  if (du_ != 0) s_end_ = std::min(s_end_, ((right_ ? end_u_ : 0.5) - p.u) * per_du_);
  if (dv_ != 0) s_end_ = std::min(s_end_, ((down_ ? end_v_ : 0.5) - p.v) * per_dv_);
}

// Returns the size of the box ahead without a cell of CellsOfMap::any; 0 if the cell is one.
int CoverageWalk::extent(Quadrant ahead, int u, int v) const {
  const PixelRect& stored = skip_map_->stored();
  const int column = u - stored.u0_px, row = v - stored.v0_px;
  if (unsigned(column) < unsigned(stored.width_px()) &&
      unsigned(row) < unsigned(stored.height_px()))
    return std::max<int>(
        skip_map_->bytes(ahead)[std::ptrdiff_t(row) * skip_map_->stride() + column], 0);
  return skip_map_->at(ahead, u, v);
}

double CoverageWalk::walk(double t, ImagePoint p) {
  if (!has_started_) {
    if (!is_in_image(p)) {
      const RayRange inside = within_image(line_, map_->whole_cells, {t, range_.end});
      if (inside.empty()) return kNever;
      t = begin_ = inside.begin;
      p = at(t);
    }
    start(t, p);
  } else if (!(p.w > kNearestToCamera_m)) {
    return kNever;  // another camera has moved t behind this one
  }
  const int max_u = map_->whole_cells.width_px() - 1, max_v = map_->whole_cells.height_px() - 1;
  const double begin = s_of(t);
  int u = floored(p.u, max_u), v = floored(p.v, max_v);
  const Quadrant ahead = quadrant_ahead(!right_, !down_);
  const int step_u = right_ ? 1 : -1, step_v = down_ ? 1 : -1;
  for (double s = begin; s < s_end_;) {
    const int empty = extent(ahead, u, v);
    // The last cells of the box: of an empty one or of one cell.
    const int last_u = u + (empty > 1 ? (empty - 1) * step_u : 0),
              last_v = v + (empty > 1 ? (empty - 1) * step_v : 0);
    const double at_u = du_ == 0 ? kNever : (last_u + int(right_) - start_.u) * per_du_,
                 at_v = dv_ == 0 ? kNever : (last_v + int(down_) - start_.v) * per_dv_;
    const bool leaves_by_u = at_u <= at_v;
    const double leaves = std::max(s, leaves_by_u ? at_u : at_v);
    if (empty == 0) {
      const double entry = entry_in_cell(u, v, s, std::min(leaves, s_end_));
      if (entry != kNever) return entry == begin ? t : std::max(t, t_of(entry));
    }
    s = leaves;
    // Steps across the box's border by index, because the rounded position may be on either side.
    if (leaves_by_u) {
      if (empty > 1)
        v = std::clamp(floored(start_.v + s * dv_, max_v), std::min(v, last_v),
                       std::max(v, last_v));
      u = last_u + step_u;
    } else {
      if (empty > 1)
        u = std::clamp(floored(start_.u + s * du_, max_u), std::min(u, last_u),
                       std::max(u, last_u));
      v = last_v + step_v;
    }
    if (u < 0 || v < 0 || u > max_u || v > max_v) break;
  }
  return kNever;
}

// Returns the first position on the line in [s, end] after which the coverage is at least one half,
// or kNever. The line is in the cell from s to end.
double CoverageWalk::entry_in_cell(int u, int v, double s, double end) const {
  const PixelRect& corners = map_->corners;
  const int width = corners.width_px();
  const std::uint8_t* const above = map_->coverage.data() +
                                    std::ptrdiff_t(v - 1 - corners.v0_px) * width +
                                    (u - 1 - corners.u0_px);
  const std::uint8_t* const below = above + width;
  const int s00 = side_of_border(above[0]), s10 = side_of_border(above[1]),
            s01 = side_of_border(below[0]), s11 = side_of_border(below[1]);
  if (s00 > 0 && s10 > 0 && s01 > 0 && s11 > 0) return s;
  const double by_u = s10 - s00, by_v = s01 - s00, by_uv = s00 - s10 - s01 + s11;
  const double x = start_.u + s * du_ - u, y = start_.v + s * dv_ - v;
  const Quadratic f{s00 + by_u * x + (by_v + by_uv * x) * y,
                    by_u * du_ + by_v * dv_ + by_uv * (x * dv_ + y * du_), by_uv * du_ * dv_};
  if (f.constant > kUncertainSide) return s;
  const double length = end - s;
  return s +
         (f.constant < -kUncertainSide ? first_rise(f, length) : first_positive_piece(f, length));
}

CoverageEntry next_entry(std::span<CoverageWalk> walks, const RayRange& range) {
  CoverageEntry entry{range.begin, -1, true};
  for (std::size_t camera = 0, agreed = 0; agreed < walks.size();
       camera = camera + 1 == walks.size() ? 0 : camera + 1) {
    ++agreed;
    const double inside = walks[camera].next_inside(entry.t);
    if (!(inside > entry.t)) continue;
    if (!(inside < range.end)) return {kNever, -1, true};
    entry = {inside, std::int32_t(camera), true};
    agreed = 1;
  }
  // If the camera's image begins there, no border of its coverage limits the hull.
  if (entry.camera >= 0 && !(entry.t > walks[std::size_t(entry.camera)].begin())) entry.camera = -1;
  return entry;
}

}  // namespace fivepipe::hull
