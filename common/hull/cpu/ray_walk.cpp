#include "common/hull/cpu/ray_walk.h"

#include <algorithm>
#include <cmath>

namespace fivepipe::hull {
namespace {

// Rays are walked in the bounds of a map's object pixels, widened by this margin. A walk then
// crosses a pixel border before every hull point.
constexpr int kAround_px = 1;

// Keeps the part of the range with offset + t * slope >= 0. `crossing` is the t where it is 0.
void clip(RayRange& range, double offset, double slope, double crossing) {
  const bool in_at_begin = offset + range.begin * slope >= 0,
             in_at_end = offset + range.end * slope >= 0;
  if (in_at_begin && in_at_end) return;
  if (in_at_end)
    range.begin = std::max(range.begin, crossing);
  else if (in_at_begin)
    range.end = std::min(range.end, crossing);
  else
    range.end = range.begin;
}

RayRange within(const ImageLine& l, const PixelRect& window, RayRange range) {
  clip(range, l.w_offset - kNearestToCamera_m, l.w_slope,
       (kNearestToCamera_m - l.w_offset) / l.w_slope);
  const auto axis = [&](double offset, double slope, int low, int high) {
    if (!range.empty())
      clip(range, offset - low * l.w_offset, slope - low * l.w_slope,
           border_crossing(offset, slope, l.w_offset, l.w_slope, low));
    if (!range.empty())
      clip(range, high * l.w_offset - offset, high * l.w_slope - slope,
           border_crossing(offset, slope, l.w_offset, l.w_slope, high));
  };
  axis(l.u_offset, l.u_slope, window.u0_px, window.u1_px);
  axis(l.v_offset, l.v_slope, window.v0_px, window.v1_px);
  return range;
}

int floored(double x, int low, int high) {
  return !(x > low) ? low : x >= high ? high : int(std::floor(x));
}

// Returns the parameter >= t at which the image crosses `border` of one axis, which is ahead of its
// pixel. Returns t if rounding puts the image at the border already, and kNever if the image does
// not move or would reach the border only behind the camera.
double crossing(double offset, double slope, double w_offset, double w_slope, int border,
                double t) {
  const double at = border_crossing(offset, slope, w_offset, w_slope, border);
  if (at > t) return at;
  return w_offset + at * w_slope > 0 ? t : kNever;
}

}  // namespace

ImageLine image_line(const geometry::Camera& camera, const geometry::Ray& ray) {
  const geometry::Pinhole& k = camera.pinhole;
  const Eigen::Vector3d o = camera.camera_from_world * ray.origin_world_m,
                        d = camera.camera_from_world.linear() * ray.direction_world;
  const double cx = k.cx_px + 0.5, cy = k.cy_px + 0.5;
  return {k.fx_px * o.x() + cx * o.z(),
          k.fx_px * d.x() + cx * d.z(),
          k.fy_px * o.y() + cy * o.z(),
          k.fy_px * d.y() + cy * d.z(),
          o.z(),
          d.z()};
}

RayRange range_in_window(const ImageLine& line, const PixelRect& window, const RayRange& range) {
  return window.empty() ? RayRange{range.end, range.end} : within(line, window, range);
}

RayRange range_in_box(const Eigen::AlignedBox3d& box_world_m, const geometry::Ray& ray,
                      RayRange range) {
  for (int axis = 0; axis < 3; ++axis) {
    const double to_low_m = box_world_m.min()[axis] - ray.origin_world_m[axis],
                 to_high_m = box_world_m.max()[axis] - ray.origin_world_m[axis],
                 direction = ray.direction_world[axis];
    if (direction == 0) {
      if (to_low_m > 0 || to_high_m < 0) range.end = range.begin;
      continue;
    }
    range.begin = std::max(range.begin, (direction > 0 ? to_low_m : to_high_m) / direction);
    range.end = std::min(range.end, (direction > 0 ? to_high_m : to_low_m) / direction);
  }
  return range;
}

RayRange overlap_range(std::span<const RayRange> ranges, int count, const RayRange& all) {
  if (count <= 0) return all;
  // `count` ranges overlap first where one begins, and last where one ends.
  RayRange found{all.end, all.begin};
  for (const RayRange& range : ranges) {
    if (range.empty()) continue;
    int at_begin = 0, at_end = 0;
    for (const RayRange& other : ranges) {
      if (other.empty()) continue;
      at_begin += other.begin <= range.begin && range.begin < other.end;
      at_end += other.begin < range.end && range.end <= other.end;
    }
    if (at_begin >= count) found.begin = std::min(found.begin, range.begin);
    if (at_end >= count) found.end = std::max(found.end, range.end);
  }
  if (found.empty()) return found;
  return {std::max(all.begin, found.begin - kRangeSlack * std::abs(found.begin)),
          std::min(all.end, found.end + kRangeSlack * std::abs(found.end))};
}

PixelRect walk_window(const geometry::Camera& camera, const SkipMap& skip_map,
                      const HullRule& rule) {
  if (rule.limits == Limits::seen) return {0, 0, camera.pinhole.width_px, camera.pinhole.height_px};
  const PixelRect& b = skip_map.bounds();
  if (b.empty()) return {};
  return {b.u0_px - kAround_px, b.v0_px - kAround_px, b.u1_px + kAround_px, b.v1_px + kAround_px};
}

MapWalk::MapWalk(const ImageLine& line, const SkipMap& skip_map, const PixelRect& window,
                 Verdict beyond, const RayRange& range)
    : line_(line),
      skip_map_(&skip_map),
      window_(window),
      beyond_(beyond),
      inside_window_(range_in_window(line, window, range)),
      right_(line.u_slope * line.w_offset > line.u_offset * line.w_slope),
      down_(line.v_slope * line.w_offset > line.v_offset * line.w_slope) {
  verdict_span_ = inside_window_.empty() ? VerdictSpan{beyond, kNever}
                                         : VerdictSpan{beyond, inside_window_.begin};
}

double MapWalk::position(double offset, double slope, double t) const {
  return (offset + t * slope) / (line_.w_offset + t * line_.w_slope);
}

// Sets the verdict of pixel (u_, v_), which holds until the ray leaves the box of equal pixels
// ahead.
void MapWalk::enter(double t) {
  const Quadrant ahead = quadrant_ahead(!right_, !down_);
  const int r = skip_map_->at(ahead, u_, v_);
  box_ = intersection(window_, quadrant_rect(ahead, u_, v_, std::abs(r)));
  const double at_u = crossing(line_.u_offset, line_.u_slope, line_.w_offset, line_.w_slope,
                               right_ ? box_.u1_px : box_.u0_px, t);
  const double at_v = crossing(line_.v_offset, line_.v_slope, line_.w_offset, line_.w_slope,
                               down_ ? box_.v1_px : box_.v0_px, t);
  in_box_ = true;
  leaves_by_u_ = at_u <= at_v;
  verdict_span_ = {r < 0 ? Verdict::object : Verdict::empty, std::min(at_u, at_v)};
}

void MapWalk::walk_to(double t) {
  if (!(t < inside_window_.end)) {
    verdict_span_ = {beyond_, kNever};
    return;
  }
  if (in_box_ && t == verdict_span_.end) {  // across the box's border: by index, because the
                                            // rounded position may be on either side
    if (leaves_by_u_) {
      u_ = right_ ? box_.u1_px : box_.u0_px - 1;
      v_ = floored(position(line_.v_offset, line_.v_slope, t), box_.v0_px, box_.v1_px - 1);
    } else {
      v_ = down_ ? box_.v1_px : box_.v0_px - 1;
      u_ = floored(position(line_.u_offset, line_.u_slope, t), box_.u0_px, box_.u1_px - 1);
    }
    if (u_ < window_.u0_px || u_ >= window_.u1_px || v_ < window_.v0_px || v_ >= window_.v1_px) {
      inside_window_.end = t;
      verdict_span_ = {beyond_, kNever};
      return;
    }
  } else {
    u_ = floored(position(line_.u_offset, line_.u_slope, t), window_.u0_px, window_.u1_px - 1);
    v_ = floored(position(line_.v_offset, line_.v_slope, t), window_.v0_px, window_.v1_px - 1);
  }
  enter(t);
}

// Returns the end of a span from t on in which the ray is outside the hull, or nullopt if the ray
// is in the hull just after t. The span may have no length: the ray crosses the corner of a pixel.
std::optional<double> RayWalk::empty_until(double t) {
  int seen = 0;
  double next_seen = kNever;
  for (MapWalk& walk : walks_) {
    const VerdictSpan verdict_span = walk.verdict_at(t);
    if (verdict_span.verdict == Verdict::empty) return verdict_span.end;
    if (verdict_span.verdict == Verdict::object)
      ++seen;
    else
      next_seen = std::min(next_seen, verdict_span.end);
  }
  if (rule_.limits == Limits::all || seen >= rule_.min_seen) return std::nullopt;
  return next_seen;
}

double RayWalk::next_entry(double t, double end) {
  if (walks_.empty()) return kNever;
  // A camera that moves the ray on is tested again until it agrees, because its walk can step
  // across the border of its current box.
  for (std::size_t camera = 0, agreed = 0; agreed < walks_.size() && rule_.limits == Limits::all;
       camera = camera + 1 == walks_.size() ? 0 : camera + 1) {
    ++agreed;
    for (VerdictSpan verdict_span;
         (verdict_span = walks_[camera].verdict_at(t)).verdict != Verdict::object; agreed = 1) {
      t = verdict_span.end;
      if (!(t < end)) return kNever;
    }
  }
  if (rule_.limits == Limits::all) return t;
  while (t < end) {
    const std::optional<double> next = empty_until(t);
    if (!next) return t;
    t = *next;
  }
  return kNever;
}

double RayWalk::next_exit(double t, double end) {
  while (t < end) {
    int seen = 0;
    double end_of_span = kNever;
    for (MapWalk& walk : walks_) {
      const VerdictSpan verdict_span = walk.verdict_at(t);
      if (verdict_span.verdict == Verdict::empty) return t;
      seen += verdict_span.verdict == Verdict::object;
      end_of_span = std::min(end_of_span, verdict_span.end);
    }
    if (rule_.limits == Limits::seen && seen < rule_.min_seen) return t;
    t = end_of_span;
  }
  return end;
}

}  // namespace fivepipe::hull
