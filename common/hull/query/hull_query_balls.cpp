// HullQuery::free_radius_m() and solid_radius_m(): balls outside and inside the hull.
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/hull/query/hull_query.h"

namespace fivepipe::hull {
namespace {

using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Beyond this distance products of lengths and focal lengths may overflow [m]; the radii are then
// 0.
constexpr double kFarthest_m = 1e100;
bool is_in_range(const Vector3d& p_world_m) {
  return p_world_m.cwiseAbs().maxCoeff() < kFarthest_m && p_world_m.allFinite();
}

// A rectangle of equal pixels around a pixel. The pixel's four boxes differ in size: each side of
// the rectangle extends as far as both boxes on that side do.
struct UniformRect {
  bool object;
  PixelRect rect;
  bool tight;  // on some side the rectangle ends with the pixel, although the next one may be equal
};
UniformRect uniform_rect_around(const SkipMap& skip_map, int u, int v) {
  const int r = skip_map.at(Quadrant::right_down, u, v);
  const int right_down = std::abs(r), left_down = std::abs(skip_map.at(Quadrant::left_down, u, v)),
            right_up = std::abs(skip_map.at(Quadrant::right_up, u, v)),
            left_up = std::abs(skip_map.at(Quadrant::left_up, u, v));
  const int left = std::min(left_down, left_up), right = std::min(right_down, right_up),
            up = std::min(right_up, left_up), down = std::min(right_down, left_down);
  return {r < 0,
          {u - left + 1, v - up + 1, u + right, v + down},
          std::min({left, right, up, down}) == 1};
}

// Returns a lower bound of the distance from the point, which has pixel (u, v), to the nearest
// pixel of the other kind, by testing the eight adjacent pixels. Pixels beyond them are at least as
// far as the border of the 3 x 3 pixels.
double distance_to_other_m(const SkipMap& skip_map, const ImageCone& cone, const ProjectedPoint& p,
                           int u, int v, bool object) {
  double nearest_m = cone.inside_m(p, cone.pyramid({u - 1, v - 1, u + 2, v + 2}));
  for (int dv = -1; dv <= 1; ++dv)
    for (int du = -1; du <= 1; ++du)
      if ((skip_map.at(Quadrant::right_down, u + du, v + dv) < 0) != object)
        nearest_m = std::min(
            nearest_m, cone.outside_m(p, cone.pyramid({u + du, v + dv, u + du + 1, v + dv + 1})));
  return nearest_m;
}

// Lower bounds of the distances from p to the box, if p is outside, and to its faces, if p is
// inside; 0 otherwise.
struct BoxClearance {
  double outside_m = 0, inside_m = 0;
};
BoxClearance box_clearance(const Eigen::AlignedBox3d& box_world_m, const Vector3d& p) {
  // A difference of coordinates has one rounding.
  constexpr double kSlack = 1 - 2 * std::numeric_limits<double>::epsilon();
  const Eigen::Array3d above_low = (p - box_world_m.min()).array(),
                       below_high = (box_world_m.max() - p).array();
  const double inside_m = above_low.min(below_high).minCoeff();
  // The largest difference along an axis: the distance is at least that.
  return {kSlack * std::max(0.0, -inside_m), kSlack * std::max(0.0, inside_m)};
}

}  // namespace

// One camera's bounds for the surroundings of a point.
struct HullQuery::CameraClearance {
  double off_object_m = 0;  // no point nearer than this is on the camera's object
  double on_object_m = 0;   // every point nearer than this is on the camera's object
  bool on_object = false, sees = false;
  double to_image_border_m =
      kInfinity;  // Limits::seen: lower bound of the distance at which `sees` changes
};

HullQuery::CameraClearance HullQuery::camera_clearance(std::size_t camera,
                                                       const Vector3d& p_world_m) const {
  const CpuHull::MapCamera& c = hull_->cameras()[camera];
  const auto& [cone, object, whole_image] = cones_[camera];
  const ProjectedPoint p = cone.see(p_world_m);
  const PixelRect image = image_of(c.camera);
  CameraClearance a;
  const bool in_front = p.p_camera_m.z() > 0;
  a.sees = in_front && holds(image, p.u_px, p.v_px);
  if (hull_->rule().limits == Limits::seen && !image.empty())
    a.to_image_border_m = a.sees ? cone.inside_m(p, whole_image) : cone.outside_m(p, whole_image);
  a.off_object_m =
      c.skip_map.bounds().empty() ? kInfinity : std::max(0.0, cone.outside_m(p, object));
  if (in_front && holds(c.skip_map.stored(), p.u_px, p.v_px)) {  // elsewhere the bounds are sharper
    const int u = int(std::floor(p.u_px + 0.5)), v = int(std::floor(p.v_px + 0.5));
    const UniformRect alike = uniform_rect_around(c.skip_map, u, v);
    double to_border_m = cone.inside_m(p, cone.pyramid(alike.rect));
    if (alike.tight)
      to_border_m =
          std::max(to_border_m, distance_to_other_m(c.skip_map, cone, p, u, v, alike.object));
    a.on_object = alike.object;
    if (alike.object)
      a.on_object_m = to_border_m;
    else
      a.off_object_m = std::max(a.off_object_m, to_border_m);
  }
  return a;
}

// A point in the hull is on the objects of at least `needed` cameras, so the needed-th smallest
// off_object_m is a valid radius. With Limits::seen, the distance up to which one camera sees all
// points off its object is valid too.
double HullQuery::free_radius_m(const Vector3d& p_world_m) const {
  if (!is_in_range(p_world_m)) return 0;
  if (hull_->unusable()) return 0;
  if (hull_->empty()) return kInfinity;
  const bool seen = hull_->rule().limits == Limits::seen;
  const std::size_t cameras = cones_.size(),
                    needed = seen ? std::size_t(std::max(hull_->rule().min_seen, 0)) : cameras;
  double radius_m = box_clearance(hull_->rule().within_world_m, p_world_m).outside_m;
  if (!seen) {
    for (std::size_t i = 0; i < cameras; ++i)
      radius_m = std::max(radius_m, camera_clearance(i, p_world_m).off_object_m);
    return radius_m;
  }
  std::vector<double> off_object_m;
  for (std::size_t i = 0; i < cameras; ++i) {
    const CameraClearance a = camera_clearance(i, p_world_m);
    off_object_m.push_back(a.off_object_m);
    if (a.sees && !a.on_object)
      radius_m = std::max(radius_m, std::min(a.off_object_m, a.to_image_border_m));
  }
  if (needed > cameras) return kInfinity;
  if (needed == 0) return radius_m;
  std::nth_element(off_object_m.begin(), off_object_m.begin() + std::ptrdiff_t(needed - 1),
                   off_object_m.end());
  return std::max(radius_m, off_object_m[needed - 1]);
}

double HullQuery::solid_radius_m(const Vector3d& p_world_m) const {
  if (hull_->empty() || !is_in_range(p_world_m)) return 0;
  const bool all = hull_->rule().limits == Limits::all;
  int seen = 0;
  double radius_m = box_clearance(hull_->rule().within_world_m, p_world_m).inside_m;
  if (!(radius_m > 0)) return 0;
  for (std::size_t i = 0; i < cones_.size(); ++i) {
    const CameraClearance a = camera_clearance(i, p_world_m);
    seen += a.sees;
    radius_m = std::min(radius_m, all || a.sees ? a.on_object_m : a.to_image_border_m);
    if (!(radius_m > 0)) return 0;
  }
  return all || seen >= hull_->rule().min_seen ? radius_m : 0;
}

}  // namespace fivepipe::hull
