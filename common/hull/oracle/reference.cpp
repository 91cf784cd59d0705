#include "common/hull/oracle/reference.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace fivepipe::hull {
namespace {

// Returns the ray parameters between lo and hi at which the image crosses a pixel border of one
// axis, ascending. Borders are at -0.5, 0.5, ..., count - 0.5; x and z are linear in t. In front of
// the camera an image moves in one direction, so it crosses the borders in order or in reverse.
std::vector<double> border_crossings(double x0, double x1, double z0, double z1, double focal_px,
                                     double principal_px, int count, double lo, double hi) {
  std::vector<double> crossings;
  for (int border = 0; border <= count; ++border) {
    const double slope = (border - 0.5 - principal_px) / focal_px;
    const double t = (slope * z0 - x0) / (x1 - slope * z1);
    if (t > lo && t < hi) crossings.push_back(t);
  }
  if (!crossings.empty() && crossings.front() > crossings.back())
    std::reverse(crossings.begin(), crossings.end());
  if (!std::is_sorted(crossings.begin(), crossings.end()))  // rounding exchanges close crossings
    std::sort(crossings.begin(), crossings.end());
  return crossings;
}

std::vector<Interval> intersection(const std::vector<Interval>& a, const std::vector<Interval>& b) {
  std::vector<Interval> both;
  for (auto i = a.begin(), j = b.begin(); i != a.end() && j != b.end();
       i->leave < j->leave ? ++i : ++j) {
    const Interval common{std::max(i->enter, j->enter), std::min(i->leave, j->leave)};
    if (common.enter < common.leave) both.push_back(common);
  }
  return both;
}

}  // namespace

std::vector<Interval> reference_intervals(const Silhouette& silhouette, const geometry::Ray& ray,
                                          double near, double far) {
  const geometry::Pinhole& k = silhouette.camera.pinhole;
  const Eigen::Vector3d origin = silhouette.camera.camera_from_world * ray.origin_world_m;
  const Eigen::Vector3d direction =
      silhouette.camera.camera_from_world.linear() * ray.direction_world;
  if (!(origin.allFinite() && direction.allFinite())) return {};

  // In front of the camera: z0 + z1 t > 0.
  double lo = near, hi = far;
  const double z0 = origin.z(), z1 = direction.z();
  if (z1 > 0)
    lo = std::max(lo, -z0 / z1);
  else if (z1 < 0)
    hi = std::min(hi, -z0 / z1);
  else if (!(z0 > 0))
    return {};
  if (!(lo < hi)) return {};

  const auto u_crossings =
      border_crossings(origin.x(), direction.x(), z0, z1, k.fx_px, k.cx_px, k.width_px, lo, hi);
  const auto v_crossings =
      border_crossings(origin.y(), direction.y(), z0, z1, k.fy_px, k.cy_px, k.height_px, lo, hi);
  std::vector<double> crossings{lo};
  std::merge(u_crossings.begin(), u_crossings.end(), v_crossings.begin(), v_crossings.end(),
             std::back_inserter(crossings));
  crossings.push_back(hi);

  // Between two crossings the line stays in the pixel that holds the centre of the interval.
  std::vector<Interval> inside;
  for (std::size_t i = 1; i < crossings.size(); ++i) {
    const double enter = crossings[i - 1], leave = crossings[i];
    const Eigen::Vector3d p = origin + 0.5 * (enter + leave) * direction;
    if (!(enter < leave) || !silhouette.pixels.contains_at(k.fx_px * p.x() / p.z() + k.cx_px,
                                                           k.fy_px * p.y() / p.z() + k.cy_px))
      continue;
    if (!inside.empty() && inside.back().leave == enter)
      inside.back().leave = leave;
    else
      inside.push_back({enter, leave});
  }
  return inside;
}

namespace {

bool holds(const std::vector<Interval>& intervals, double t) {
  return std::any_of(intervals.begin(), intervals.end(),
                     [t](const Interval& i) { return i.enter <= t && t < i.leave; });
}

// Between two adjacent crossings of all cameras no verdict changes, so the verdict at the centre of
// each interval holds for the whole interval.
std::vector<Interval> intervals_where_seen(std::span<const Silhouette> silhouettes,
                                           const geometry::Ray& ray, double near, double far,
                                           int min_seen) {
  std::vector<std::vector<Interval>> on_object, in_image;
  std::vector<double> crossings{near, far};
  for (const Silhouette& s : silhouettes) {
    Silhouette all_object{s.camera, ObjectPixels(s.pixels.width_px(), s.pixels.height_px())};
    for (int v = 0; v < s.pixels.height_px(); ++v)
      for (int u = 0; u < s.pixels.width_px(); ++u) all_object.pixels.set(u, v);
    on_object.push_back(reference_intervals(s, ray, near, far));
    in_image.push_back(reference_intervals(all_object, ray, near, far));
    for (const auto* intervals : {&on_object.back(), &in_image.back()})
      for (const Interval& i : *intervals) crossings.insert(crossings.end(), {i.enter, i.leave});
  }
  std::sort(crossings.begin(), crossings.end());
  std::vector<Interval> inside;
  for (std::size_t i = 1; i < crossings.size(); ++i) {
    const double enter = crossings[i - 1], leave = crossings[i], center = 0.5 * (enter + leave);
    if (!(enter < leave)) continue;
    int seen = 0;
    bool empty = false;
    for (std::size_t camera = 0; camera < silhouettes.size(); ++camera) {
      if (!holds(in_image[camera], center)) continue;
      ++seen;
      empty |= !holds(on_object[camera], center);
    }
    if (empty || seen < min_seen) continue;
    if (!inside.empty() && inside.back().leave == enter)
      inside.back().leave = leave;
    else
      inside.push_back({enter, leave});
  }
  return inside;
}

}  // namespace

std::vector<Interval> reference_intervals(std::span<const Silhouette> silhouettes,
                                          const geometry::Ray& ray, double near, double far,
                                          const HullRule& rule) {
  if (silhouettes.empty()) return {};
  for (int axis = 0; axis < 3; ++axis) {
    const double origin = ray.origin_world_m[axis], direction = ray.direction_world[axis],
                 low = rule.within_world_m.min()[axis], high = rule.within_world_m.max()[axis];
    if (direction == 0) {
      if (!(origin >= low && origin <= high)) return {};
      continue;
    }
    const double a = (low - origin) / direction, b = (high - origin) / direction;
    near = std::max(near, std::min(a, b)), far = std::min(far, std::max(a, b));
  }
  if (!(near < far)) return {};
  if (rule.limits == Limits::seen)
    return intervals_where_seen(silhouettes, ray, near, far, rule.min_seen);
  std::vector<Interval> inside{{near, far}};
  for (const Silhouette& s : silhouettes) {
    const double first = inside.front().enter, last = inside.back().leave;
    inside = intersection(inside, reference_intervals(s, ray, first, last));
    if (inside.empty()) break;
  }
  return inside;
}

std::optional<double> reference_depth_m(std::span<const Silhouette> silhouettes, const View& view,
                                        int u_px, int v_px, const HullRule& rule) {
  const auto inside = reference_intervals(
      silhouettes, geometry::ray_through(view.camera, Eigen::Vector2d(u_px, v_px)), view.near_m,
      view.far_m, rule);
  return inside.empty() ? std::nullopt : std::optional(inside.front().enter);
}

}  // namespace fivepipe::hull
