// Sources: the point of a convex polyhedron nearest to an outside point is on a face that faces
// this point (Ericson, Real-Time Collision Detection, 5.1). Branch and bound finds the nearest of
// many candidates, over halved rectangles of pixels and over octants.
#include "common/collision/oracle/distance_reference.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <queue>

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Radius of the smallest octants, as a fraction of the tolerance: the bounds from an octant that is
// still open and from the next one in the hull then differ by less than the tolerance.
constexpr double kFinestOctant = 0.125;

double to_half_line_m(const Vector3d& q, const Vector3d& direction) {
  const double t = std::max(0.0, q.dot(direction) / direction.squaredNorm());
  return (q - t * direction).norm();
}

// A part of the search space, with a lower bound of its distance.
template <class Part>
struct Candidate {
  double nearest_m;
  Part part;
  bool operator<(const Candidate& other) const {
    return nearest_m > other.nearest_m;  // a priority_queue has the nearest candidate on top
  }
};

struct Cube {
  Vector3d center_world_m;
  double half_m;
  double distance_m(const Vector3d& p) const {
    return ((p - center_world_m).cwiseAbs().array() - half_m).max(0.0).matrix().norm();
  }
};

}  // namespace

HullDistance::Cone::Cone(const hull::Silhouette& s)
    : silhouette(&s),
      world_from_camera(s.camera.camera_from_world.linear().inverse()),
      center_world_m(-(world_from_camera * s.camera.camera_from_world.translation())) {
  const int width = s.pixels.width_px(), height = s.pixels.height_px();
  objects_before.resize(std::size_t(width + 1) * (height + 1));
  object_bounds = {width, height, 0, 0};
  for (int v = 0; v < height; ++v)
    for (int u = 0, in_row = 0; u < width; ++u) {
      if (s.pixels.contains(u, v)) {
        ++in_row;
        hull::PixelRect& b = object_bounds;
        b = {std::min(b.u0_px, u), std::min(b.v0_px, v), std::max(b.u1_px, u + 1), v + 1};
      }
      const std::size_t above = std::size_t(v) * (width + 1) + u + 1;
      objects_before[above + width + 1] = objects_before[above] + in_row;
    }
  const geometry::Pinhole& k = s.camera.pinhole;
  const Eigen::Matrix3d of_planes = s.camera.camera_from_world.linear().transpose();
  for (int u = 0; u <= width; ++u)
    column_normals.push_back((of_planes * Vector3d(k.fx_px, 0, k.cx_px - (u - 0.5))).normalized());
  for (int v = 0; v <= height; ++v)
    row_normals.push_back((of_planes * Vector3d(0, k.fy_px, k.cy_px - (v - 0.5))).normalized());
}

HullDistance::HullDistance(std::span<const hull::Silhouette> silhouettes)
    : silhouettes_(silhouettes), usable_(!silhouettes.empty()) {
  for (const hull::Silhouette& s : silhouettes)
    usable_ = usable_ && !geometry::why_unusable(s.camera);
  if (!usable_) return;
  for (const hull::Silhouette& s : silhouettes) cones_.emplace_back(s);
}

std::size_t HullDistance::Cone::count(const hull::PixelRect& r) const {
  const auto before = [&](int u, int v) {
    return objects_before[std::size_t(v) * (silhouette->pixels.width_px() + 1) + u];
  };
  return std::size_t(before(r.u1_px, r.v1_px) - before(r.u0_px, r.v1_px) -
                     before(r.u1_px, r.v0_px) + before(r.u0_px, r.v0_px));
}

double HullDistance::Cone::to_pyramid_m(const Vector3d& q, const hull::PixelRect& r) const {
  const geometry::Pinhole& k = silhouette->camera.pinhole;
  const auto sight = [&](int u, int v) -> Vector3d {
    return world_from_camera *
           Vector3d((u - 0.5 - k.cx_px) / k.fx_px, (v - 0.5 - k.cy_px) / k.fy_px, 1);
  };
  // Faces around the pyramid: left, top, right, bottom. Edge i is between faces i and i + 1.
  const std::array<Vector3d, 4> inward = {column_normals[r.u0_px], row_normals[r.v0_px],
                                          -column_normals[r.u1_px], -row_normals[r.v1_px]};
  const auto edge = [&](int i) {
    return sight(i == 0 || i == 3 ? r.u0_px : r.u1_px, i < 2 ? r.v0_px : r.v1_px);
  };
  double nearest_m = kInfinity;
  bool outside = false;
  for (int i = 0; i < 4; ++i) {
    const double depth = inward[i].dot(q);
    if (depth >= 0) continue;
    outside = true;
    const Vector3d foot = q - depth * inward[i];
    const bool on_face = inward[(i + 1) % 4].dot(foot) >= 0 && inward[(i + 3) % 4].dot(foot) >= 0;
    if (on_face)
      nearest_m = std::min(nearest_m, -depth);
    else
      nearest_m =
          std::min({nearest_m, to_half_line_m(q, edge(i)), to_half_line_m(q, edge((i + 3) % 4))});
  }
  return outside ? nearest_m : 0;
}

double HullDistance::Cone::to_pixels_m(const Vector3d& q, bool object, double max_m) const {
  std::priority_queue<Candidate<hull::PixelRect>> rects;
  const auto add = [&](const hull::PixelRect& r) {
    const std::size_t wanted = object ? count(r) : r.area_px() - count(r);
    if (wanted > 0) rects.push({to_pyramid_m(q, r), r});
  };
  if (!object)
    add({0, 0, silhouette->pixels.width_px(), silhouette->pixels.height_px()});
  else if (!object_bounds.empty())
    add(object_bounds);
  while (!rects.empty()) {
    const auto [nearest_m, r] = rects.top();
    rects.pop();
    if (nearest_m >= max_m) break;
    if (count(r) == (object ? r.area_px() : 0))
      return nearest_m;  // every pixel matches, and all other candidates are farther
    const bool wide = r.width_px() >= r.height_px();
    const int u = wide ? (r.u0_px + r.u1_px) / 2 : r.u1_px,
              v = wide ? r.v1_px : (r.v0_px + r.v1_px) / 2;
    add({r.u0_px, r.v0_px, u, v});
    add(wide ? hull::PixelRect{u, r.v0_px, r.u1_px, r.v1_px}
             : hull::PixelRect{r.u0_px, v, r.u1_px, r.v1_px});
  }
  return max_m;
}

bool HullDistance::Cone::contains(const Vector3d& p_world_m) const {
  const geometry::Pinhole& k = silhouette->camera.pinhole;
  const Vector3d p = silhouette->camera.camera_from_world * p_world_m;
  return p.z() > 0 && silhouette->pixels.contains_at(k.fx_px * p.x() / p.z() + k.cx_px,
                                                     k.fy_px * p.y() / p.z() + k.cy_px);
}

// The nearest point outside the cone is outside the image's pyramid, and then possibly behind the
// camera, or on another pixel in the pyramid.
double HullDistance::Cone::depth_m(const Vector3d& p_world_m, double max_m) const {
  const Vector3d q = p_world_m - center_world_m;
  const double columns_m = std::min(column_normals.front().dot(q), -column_normals.back().dot(q));
  const double border_m =
      std::min({columns_m, row_normals.front().dot(q), -row_normals.back().dot(q)});
  return to_pixels_m(q, false, std::clamp(border_m, 0.0, max_m));
}

double HullDistance::Cone::distance_m(const Vector3d& p_world_m, double max_m) const {
  return to_pixels_m(p_world_m - center_world_m, true, max_m);
}

double HullDistance::signed_m(const Vector3d& p_world_m) const {
  if (!usable_ || !p_world_m.allFinite()) return -kInfinity;
  double distance_m = 0;
  bool inside = true;
  for (const Cone& cone : cones_) {
    if (cone.contains(p_world_m)) continue;
    inside = false;
    distance_m = std::max(distance_m, cone.distance_m(p_world_m, kInfinity));
  }
  if (!inside) return -distance_m;
  double depth_m = kInfinity;
  for (const Cone& cone : cones_) depth_m = cone.depth_m(p_world_m, depth_m);
  return depth_m;
}

double HullDistance::clear_m(const Vector3d& p_world_m, double max_m) const {
  if (!p_world_m.allFinite()) return 0;
  if (!usable_) return max_m;
  double clear_m = 0;
  for (const Cone& cone : cones_) {
    clear_m = std::max(clear_m, cone.distance_m(p_world_m, max_m));
    if (clear_m >= max_m) break;
  }
  return clear_m;
}

double HullDistance::depth_m(const Vector3d& p_world_m) const {
  return std::max(0.0, signed_m(p_world_m));
}

// Searches the octants of a cube around p, nearest first. A ball around an octant's center with the
// signed distance as its radius is wholly in the hull or wholly outside.
Clearance HullDistance::clearance_m(const Vector3d& p_world_m, double cap_m,
                                    double tolerance_m) const {
  assert(tolerance_m > 0 && cap_m >= 0);
  if (!p_world_m.allFinite()) return {0, kInfinity};
  const double here_m = signed_m(p_world_m);
  if (here_m > 0) return {0, 0};
  // Distances of the nearest hull point and of the nearest octant that is too small to split.
  double found_m = kInfinity, open_m = kInfinity;
  std::priority_queue<Candidate<Cube>> cubes;
  if (-here_m <= cap_m) cubes.push({0, {p_world_m, cap_m}});
  for (int visited = 0; !cubes.empty(); ++visited) {
    const auto [nearest_m, cube] = cubes.top();
    if (nearest_m + tolerance_m >= found_m || nearest_m > cap_m || visited == kMaxClearanceCells) {
      open_m = std::min(open_m, nearest_m);
      break;
    }
    cubes.pop();
    const double radius_m = std::sqrt(3.0) * cube.half_m, depth_m = signed_m(cube.center_world_m);
    if (depth_m < -radius_m) continue;
    if (depth_m > 0)
      found_m =
          std::min(found_m, std::max(0.0, (cube.center_world_m - p_world_m).norm() - depth_m));
    if (radius_m <= kFinestOctant * tolerance_m) {
      open_m = std::min(open_m, nearest_m);
      continue;
    }
    for (int octant = 0; octant < 8; ++octant) {
      const double h = 0.5 * cube.half_m;
      const Cube part{cube.center_world_m +
                          Vector3d(octant & 1 ? h : -h, octant & 2 ? h : -h, octant & 4 ? h : -h),
                      h};
      cubes.push({part.distance_m(p_world_m), part});
    }
  }
  return {std::min(cap_m, std::max({0.0, -here_m, std::min(open_m, found_m)})),
          found_m <= cap_m ? found_m : kInfinity};
}

}  // namespace fivepipe::collision
