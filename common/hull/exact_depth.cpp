#include "common/hull/exact_depth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/hull/map_from_view.h"

namespace fivepipe {
namespace {

using Eigen::Vector3d;

constexpr double kNever = std::numeric_limits<double>::infinity();

// A ray's image this close to a pixel border, and not before it, is taken to be on it [px]: 1000 times the rounding of a
// 10,000 px image, a millionth of the accuracy of any calibration.
constexpr double kOnBorder_px = 1e-8;
// Slack of the ranges shared by a block of rays, as a fraction: each ray then finds its own start, whatever its block.
constexpr double kBlockSlack = 1e-9;
// Blocks of rays up to this size move together while all are in empty space; those of the smaller size are traced ray by ray.
constexpr int kMarchedBlock_px = 16, kBlock_px = 4;

struct Range {
  double begin, end;  // ray parameters [m]
  bool empty() const { return !(begin < end); }
};

void clip(Range& range, double offset, double slope) {
  const bool in_at_begin = offset + range.begin * slope >= 0, in_at_end = offset + range.end * slope >= 0;
  if (in_at_begin && in_at_end) return;
  const double t = -offset / slope;
  if (in_at_end) range.begin = std::max(range.begin, t);
  else if (in_at_begin) range.end = std::min(range.end, t);
  else range.end = range.begin;
}

struct SeenMap {
  MapFromView from_view;
  const EmptySpace* space;
};

// The image of one ray in one map.
struct Line {
  double u_offset, u_slope, v_offset, v_slope, w_offset, w_slope;
  const EmptySpace* space;

  int pixel_u(double t) const { return floored((u_offset + t * u_slope) / (w_offset + t * w_slope), space->bounds().u0_px, space->bounds().u1_px - 1); }
  int pixel_v(double t) const { return floored((v_offset + t * v_slope) / (w_offset + t * w_slope), space->bounds().v0_px, space->bounds().v1_px - 1); }

  bool goes_right() const { return u_slope * w_offset > u_offset * w_slope; }
  bool goes_down() const { return v_slope * w_offset > v_offset * w_slope; }

  // Within the bounds to which the ray is clipped; rounding may reach over them.
  static int floored(double x, int least, int most) { return !(x > least) ? least : x >= most ? most : int(x); }
};

// Parameter >= t at which the image crosses `border` of one axis; t itself where it is on the border already; never where it
// stands still or has passed it.
double crossing(double offset, double slope, double w_offset, double w_slope, int border, double t) {
  const double at = (border * w_offset - offset) / (slope - border * w_slope);
  if (at > t) return at;
  const double w = w_offset + t * w_slope;
  return std::abs(offset + t * slope - border * w) <= kOnBorder_px * w ? t : kNever;
}

// Parameter >= t up to which all rays between four corner rays stay off one map's object pixels: while the corners' images lie
// in one empty rectangle, in front of the camera, so do the images of all rays between them. t itself where that can't be said.
double free_until(const std::array<Line, 4>& corners, double t) {
  const Line& first = corners[0];
  PixelRect free;
  double until = kNever;
  for (const Line& line : corners) {
    const double w = line.w_offset + t * line.w_slope;
    if (!(w > 0)) return t;
    if (&line == &first) free = line.space->around(line.pixel_u(t), line.pixel_v(t));
    const double u = (line.u_offset + t * line.u_slope) / w, v = (line.v_offset + t * line.v_slope) / w;
    if (!(u > free.u0_px && v > free.v0_px && u < free.u1_px && v < free.v1_px)) return t;
    until = std::min({until, crossing(line.u_offset, line.u_slope, line.w_offset, line.w_slope, line.goes_right() ? free.u1_px : free.u0_px, t),
                      crossing(line.v_offset, line.v_slope, line.w_offset, line.w_slope, line.goes_down() ? free.v1_px : free.v0_px, t)});
    if (line.w_slope < 0) until = std::min(until, -line.w_offset / line.w_slope);
  }
  return std::max(until, t);
}

// First parameter >= t at which the image is on an object pixel; kNever if that is not before `end`.
double first_on_object(const Line& line, double t, double end) {
  const bool right = line.goes_right(), down = line.goes_down();
  const PixelRect& bounds = line.space->bounds();
  int u = line.pixel_u(t), v = line.pixel_v(t);
  for (;;) {
    const PixelRect free = line.space->around(u, v);
    if (free.empty()) return t;
    const double at_u = crossing(line.u_offset, line.u_slope, line.w_offset, line.w_slope, right ? free.u1_px : free.u0_px, t);
    const double at_v = crossing(line.v_offset, line.v_slope, line.w_offset, line.w_slope, down ? free.v1_px : free.v0_px, t);
    t = std::min(at_u, at_v);
    if (!(t < end)) return kNever;
    if (at_u <= at_v) {
      u = right ? free.u1_px : free.u0_px - 1;
      v = std::clamp(line.pixel_v(t), free.v0_px, free.v1_px - 1);
    } else {
      v = down ? free.v1_px : free.v0_px - 1;
      u = std::clamp(line.pixel_u(t), free.u0_px, free.u1_px - 1);
    }
    if (u < bounds.u0_px || u >= bounds.u1_px || v < bounds.v0_px || v >= bounds.v1_px) return kNever;
  }
}

// First parameter at which all images are on object pixels: each camera in turn moves the candidate on until all agree.
double first_in_hull(std::span<const Line> lines, Range range) {
  double t = range.begin;
  for (std::size_t i = 0, agreeing = 0; agreeing < lines.size(); i = i + 1 == lines.size() ? 0 : i + 1) {
    const double at = first_on_object(lines[i], t, range.end);
    if (at == kNever) return kNever;
    agreeing = at > t ? 1 : agreeing + 1;
    t = at;
  }
  return t;
}

// Depths of a rectangle of rays, block by block: blocks whose rays all miss one camera's bounds go together.
class Tracer {
 public:
  Tracer(std::vector<SeenMap> maps, const View& view, DepthTile& tile) : maps_(std::move(maps)), lines_(maps_.size()), tile_(tile) {
    for (const SeenMap& map : maps_) add_half_spaces(map.from_view, map.space->bounds(), half_spaces_);
    trace(tile.rect, {view.near_m, view.far_m});
  }

 private:
  void trace(const PixelRect& rays, Range range) {
    Range shared = shared_range(rays, range);
    if (shared.empty()) return;
    if (rays.width_px() <= kMarchedBlock_px && rays.height_px() <= kMarchedBlock_px) {
      shared.begin = std::max(shared.begin, shared_start(rays, shared) * (1 - kBlockSlack));
      if (shared.empty()) return;
    }
    if (rays.width_px() <= kBlock_px && rays.height_px() <= kBlock_px) return trace_each(rays, shared);
    const int u = (rays.u0_px + rays.u1_px) / 2, v = (rays.v0_px + rays.v1_px) / 2;
    if (rays.width_px() >= rays.height_px()) {
      trace({rays.u0_px, rays.v0_px, u, rays.v1_px}, shared);
      trace({u, rays.v0_px, rays.u1_px, rays.v1_px}, shared);
    } else {
      trace({rays.u0_px, rays.v0_px, rays.u1_px, v}, shared);
      trace({rays.u0_px, v, rays.u1_px, rays.v1_px}, shared);
    }
  }

  // A range that holds the clipped range of every ray, and in cutting_ the half-spaces that clip it further for some ray.
  // A slope is linear over the rays: its extremes are at the corners.
  Range shared_range(const PixelRect& rays, Range range) {
    slopes_.clear();
    Range tight = range;
    for (const HalfSpace& h : half_spaces_) {
      slopes_.push_back(std::minmax({h.slope_at(rays.u0_px, rays.v0_px), h.slope_at(rays.u1_px - 1, rays.v0_px),
                                     h.slope_at(rays.u0_px, rays.v1_px - 1), h.slope_at(rays.u1_px - 1, rays.v1_px - 1)}));
      clip(tight, h.offset, slopes_.back().second);
      if (tight.empty()) return tight;
    }
    range = {std::max(range.begin, tight.begin * (1 - kBlockSlack)), std::min(range.end, tight.end * (1 + kBlockSlack))};
    cutting_.clear();
    for (std::size_t i = 0; i < half_spaces_.size(); ++i) {
      const double offset = half_spaces_[i].offset, least = slopes_[i].first;
      if (!(offset + range.begin * least >= 0 && offset + range.end * least >= 0)) cutting_.push_back(&half_spaces_[i]);
    }
    return range;
  }

  // Where the first hull point of any ray in the block may be: cameras in turn move the whole block on while they can.
  double shared_start(const PixelRect& rays, const Range& range) {
    corners_.clear();
    for (const SeenMap& map : maps_)
      corners_.push_back({line(map, rays.u0_px, rays.v0_px), line(map, rays.u1_px - 1, rays.v0_px), line(map, rays.u0_px, rays.v1_px - 1), line(map, rays.u1_px - 1, rays.v1_px - 1)});
    double t = range.begin;
    for (std::size_t i = 0, stuck = 0; stuck < corners_.size() && t < range.end; i = i + 1 == corners_.size() ? 0 : i + 1) {
      const double until = free_until(corners_[i], t);
      stuck = until > t ? 0 : stuck + 1;
      t = until;
    }
    return t;
  }

  static Line line(const SeenMap& map, int u, int v) {
    const Vector3d slope = map.from_view.at_infinity * Vector3d(u, v, 1);
    const Vector3d& offset = map.from_view.at_eye;
    return {offset.x(), slope.x(), offset.y(), slope.y(), offset.z(), slope.z(), map.space};
  }

  void trace_each(const PixelRect& rays, const Range& range) {
    for (int v = rays.v0_px; v < rays.v1_px; ++v)
      for (int u = rays.u0_px; u < rays.u1_px; ++u)
        if (const double t = trace_one(u, v, range); t != kNever)
          tile_.depth_m[std::size_t(v - tile_.rect.v0_px) * tile_.rect.width_px() + (u - tile_.rect.u0_px)] = float(t);
  }

  double trace_one(int u, int v, Range range) {
    for (const HalfSpace* h : cutting_) {
      clip(range, h->offset, h->slope_at(u, v));
      if (range.empty()) return kNever;
    }
    for (std::size_t i = 0; i < maps_.size(); ++i) lines_[i] = line(maps_[i], u, v);
    return first_in_hull(lines_, range);
  }

  std::vector<SeenMap> maps_;
  std::vector<HalfSpace> half_spaces_;
  std::vector<std::pair<double, double>> slopes_;  // least and most over the block, by half-space
  std::vector<const HalfSpace*> cutting_;  // those that cut some ray of the block
  std::vector<std::array<Line, 4>> corners_;  // of the block at hand, by map
  std::vector<Line> lines_;                   // of the ray at hand, by map
  DepthTile& tile_;
};

// The order in which cameras are asked: smallest object first, it clears most; the rest only so that the given order never shows.
bool asked_before(const Silhouette* a, const Silhouette* b) {
  const auto key = [](const Silhouette& s) {
    const auto& m = s.camera.camera_from_world.matrix();
    std::vector<double> numbers{double(s.pixels.bounds().area_px()), s.camera.pinhole.fx_px, s.camera.pinhole.fy_px, s.camera.pinhole.cx_px, s.camera.pinhole.cy_px};
    numbers.insert(numbers.end(), m.data(), m.data() + m.size());
    return numbers;
  };
  const auto key_a = key(*a), key_b = key(*b);
  if (key_a != key_b) return key_a < key_b;
  return std::ranges::lexicographical_compare(a->pixels.words(), b->pixels.words());
}

}  // namespace

ExactHull::ExactHull(std::span<const Silhouette> silhouettes) {
  std::vector<const Silhouette*> order;
  for (const Silhouette& s : silhouettes) {
    if (!is_finite(s.camera)) empty_ = true;
    order.push_back(&s);
  }
  if (silhouettes.empty()) empty_ = true;
  if (empty_) return;
  std::sort(order.begin(), order.end(), asked_before);
  for (const Silhouette* s : order) {
    cameras_.push_back({s->camera, EmptySpace(s->pixels)});
    if (cameras_.back().space.bounds().empty()) empty_ = true;
  }
}

DepthTile ExactHull::depth(const View& view, const PixelRect& rect) const {
  DepthTile tile{rect, std::vector<float>(rect.area_px(), kNoHull)};
  if (empty_ || rect.empty() || !is_finite(view.camera) || !(view.near_m > 0 && view.far_m > view.near_m && std::isfinite(view.far_m))) return tile;
  std::vector<SeenMap> maps;
  for (const MapCamera& c : cameras_) maps.push_back({map_from_view(c.camera, view.camera), &c.space});
  Tracer(std::move(maps), view, tile);
  return tile;
}

DepthTile exact_depth(std::span<const Silhouette> silhouettes, const View& view, const PixelRect& rect) {
  return ExactHull(silhouettes).depth(view, rect);
}

}  // namespace fivepipe
