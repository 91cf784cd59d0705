// Sources: the nearest point of a convex polyhedron lies on a face that looks at the point (Ericson, Real-Time Collision Detection, 5.1);
// nearest of many by branch and bound, here over halved rectangles of pixels and over octants.
#include "common/collision/distance_reference.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <queue>

namespace fivepipe {
namespace {

using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

double to_half_line_m(const Vector3d& q, const Vector3d& direction) {
  const double t = std::max(0.0, q.dot(direction) / direction.squaredNorm());
  return (q - t * direction).norm();
}

// Part of what is searched, and how near it may be.
template <class Part>
struct Candidate {
  double nearest_m;
  Part part;
  bool operator<(const Candidate& other) const { return nearest_m > other.nearest_m; }  // the nearest on top of a priority_queue
};

struct Cube {
  Vector3d center_world_m;
  double half_m;
  double distance_m(const Vector3d& p) const { return ((p - center_world_m).cwiseAbs().array() - half_m).max(0.0).matrix().norm(); }
};

}  // namespace

HullDistance::HullDistance(std::span<const Silhouette> silhouettes) : silhouettes_(silhouettes), usable_(!silhouettes.empty()) {
  for (const Silhouette& s : silhouettes) {
    usable_ = usable_ && !why_unusable(s.camera);
    const Eigen::Matrix3d world_from_camera = s.camera.camera_from_world.linear().inverse();
    Cone cone{&s, -(world_from_camera * s.camera.camera_from_world.translation()), world_from_camera, {}};
    const int width = s.pixels.width_px(), height = s.pixels.height_px();
    cone.objects_before.resize(std::size_t(width + 1) * (height + 1));
    for (int v = 0; v < height; ++v)
      for (int u = 0, in_row = 0; u < width; ++u) {
        in_row += s.pixels.contains(u, v);
        const std::size_t above = std::size_t(v) * (width + 1) + u + 1;
        cone.objects_before[above + width + 1] = cone.objects_before[above] + in_row;
      }
    cones_.push_back(std::move(cone));
  }
}

std::size_t HullDistance::Cone::count(const PixelRect& r) const {
  const auto before = [&](int u, int v) { return objects_before[std::size_t(v) * (silhouette->pixels.width_px() + 1) + u]; };
  return std::size_t(before(r.u1_px, r.v1_px) - before(r.u0_px, r.v1_px) - before(r.u1_px, r.v0_px) + before(r.u0_px, r.v0_px));
}

// Unit normals, in the world, of the planes through the camera's centre and a border of pixels; towards greater u, or v, in front of it.
Vector3d HullDistance::Cone::column_normal(double border_px) const {
  const Pinhole& k = silhouette->camera.pinhole;
  return (silhouette->camera.camera_from_world.linear().transpose() * Vector3d(k.fx_px, 0, k.cx_px - border_px)).normalized();
}
Vector3d HullDistance::Cone::row_normal(double border_px) const {
  const Pinhole& k = silhouette->camera.pinhole;
  return (silhouette->camera.camera_from_world.linear().transpose() * Vector3d(0, k.fy_px, k.cy_px - border_px)).normalized();
}
Vector3d HullDistance::Cone::sight(double u_px, double v_px) const {
  const Pinhole& k = silhouette->camera.pinhole;
  return world_from_camera * Vector3d((u_px - k.cx_px) / k.fx_px, (v_px - k.cy_px) / k.fy_px, 1);
}

double HullDistance::Cone::to_pyramid_m(const Vector3d& q, const PixelRect& r) const {
  const double u0 = r.u0_px - 0.5, u1 = r.u1_px - 0.5, v0 = r.v0_px - 0.5, v1 = r.v1_px - 0.5;
  // Round the pyramid: left, up, right, down; edge i between faces i and i + 1.
  const std::array<Vector3d, 4> inward = {column_normal(u0), row_normal(v0), -column_normal(u1), -row_normal(v1)};
  const std::array<Vector3d, 4> edges = {sight(u0, v0), sight(u1, v0), sight(u1, v1), sight(u0, v1)};
  double nearest_m = kInfinity;
  bool outside = false;
  for (int i = 0; i < 4; ++i) {
    const double depth = inward[i].dot(q);
    if (depth >= 0) continue;
    outside = true;
    const Vector3d foot = q - depth * inward[i];
    const bool on_face = inward[(i + 1) % 4].dot(foot) >= 0 && inward[(i + 3) % 4].dot(foot) >= 0;
    if (on_face) nearest_m = std::min(nearest_m, -depth);
    else nearest_m = std::min({nearest_m, to_half_line_m(q, edges[i]), to_half_line_m(q, edges[(i + 3) % 4])});
  }
  return outside ? nearest_m : 0;
}

// To the nearest pixel that is an object pixel, or to the nearest of the image that is none; infinity where there is none.
double HullDistance::Cone::to_pixels_m(const Vector3d& q, bool object) const {
  const PixelRect image{0, 0, silhouette->pixels.width_px(), silhouette->pixels.height_px()};
  std::priority_queue<Candidate<PixelRect>> rects;
  const auto add = [&](const PixelRect& r) {
    const std::size_t wanted = object ? count(r) : r.area_px() - count(r);
    if (wanted > 0) rects.push({to_pyramid_m(q, r), r});
  };
  add(image);
  while (!rects.empty()) {
    const auto [nearest_m, r] = rects.top();
    rects.pop();
    if (count(r) == (object ? r.area_px() : 0)) return nearest_m;  // all of it is wanted, and all else is farther
    const bool wide = r.width_px() >= r.height_px();
    const int u = wide ? (r.u0_px + r.u1_px) / 2 : r.u1_px, v = wide ? r.v1_px : (r.v0_px + r.v1_px) / 2;
    add({r.u0_px, r.v0_px, u, v});
    add(wide ? PixelRect{u, r.v0_px, r.u1_px, r.v1_px} : PixelRect{r.u0_px, v, r.u1_px, r.v1_px});
  }
  return kInfinity;
}

// From a point in the image's pyramid to the outside, and with it to all that is behind the camera.
double HullDistance::Cone::to_image_border_m(const Vector3d& q) const {
  const ObjectPixels& pixels = silhouette->pixels;
  return std::max(0.0, std::min({column_normal(-0.5).dot(q), -column_normal(pixels.width_px() - 0.5).dot(q), row_normal(-0.5).dot(q),
                                 -row_normal(pixels.height_px() - 0.5).dot(q)}));
}

double HullDistance::Cone::signed_m(const Vector3d& p_world_m) const {
  const Pinhole& k = silhouette->camera.pinhole;
  const Vector3d p = silhouette->camera.camera_from_world * p_world_m, q = p_world_m - center_world_m;
  const bool inside = p.z() > 0 && silhouette->pixels.contains_at(k.fx_px * p.x() / p.z() + k.cx_px, k.fy_px * p.y() / p.z() + k.cy_px);
  return inside ? std::min(to_image_border_m(q), to_pixels_m(q, false)) : -to_pixels_m(q, true);
}

double HullDistance::signed_m(const Vector3d& p_world_m) const {
  if (!usable_ || !p_world_m.allFinite()) return -kInfinity;
  double least_m = kInfinity;
  for (const Cone& cone : cones_) least_m = std::min(least_m, cone.signed_m(p_world_m));
  return least_m;
}

double HullDistance::depth_m(const Vector3d& p_world_m) const { return std::max(0.0, signed_m(p_world_m)); }

// Octants of the cube round p, the nearest first. In a ball of the signed distance round an octant's centre there is nothing but hull, or
// none of it.
Clearance HullDistance::clearance_m(const Vector3d& p_world_m, double cap_m, double tolerance_m) const {
  assert(tolerance_m > 0 && cap_m >= 0);
  const double here_m = signed_m(p_world_m);
  if (here_m > 0) return {0, 0};
  double found_m = kInfinity, open_m = kInfinity;  // the nearest hull point; the nearest octant too small to be split further
  std::priority_queue<Candidate<Cube>> cubes;
  if (-here_m <= cap_m) cubes.push({0, {p_world_m, cap_m}});
  for (int taken = 0; !cubes.empty(); ++taken) {
    const auto [nearest_m, cube] = cubes.top();
    if (nearest_m + tolerance_m >= found_m || nearest_m > cap_m || taken == kMostClearanceCells) {
      open_m = std::min(open_m, nearest_m);
      break;
    }
    cubes.pop();
    const double radius_m = std::sqrt(3.0) * cube.half_m, depth_m = signed_m(cube.center_world_m);
    if (depth_m < -radius_m) continue;
    if (depth_m > 0) found_m = std::min(found_m, std::max(0.0, (cube.center_world_m - p_world_m).norm() - depth_m));
    if (2 * radius_m <= tolerance_m) {
      open_m = std::min(open_m, nearest_m);
      continue;
    }
    for (int octant = 0; octant < 8; ++octant) {
      const double h = 0.5 * cube.half_m;
      const Cube part{cube.center_world_m + Vector3d(octant & 1 ? h : -h, octant & 2 ? h : -h, octant & 4 ? h : -h), h};
      cubes.push({part.distance_m(p_world_m), part});
    }
  }
  return {std::min(cap_m, std::max({0.0, -here_m, std::min(open_m, found_m)})), found_m <= cap_m ? found_m : kInfinity};
}

}  // namespace fivepipe
