#include "sim_node/particles/solid_touch.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/collision/proximity/nearest_point.h"

namespace fivepipe::sim {
namespace {

using Eigen::Vector3d;

// Smallest cosine between a triangle's normal and the way from its nearest point to the path's end,
// if the path has crossed the triangle: below it, the path has passed beside the mesh.
constexpr double kThrough = 0.7;

bool is_finite(const PathInStep& path) { return path.from_m.allFinite() && path.to_m.allFinite(); }

SolidTouch face(int axis, double side, const Vector3d& half_m, const Vector3d& to_m) {
  return {side * Vector3d::Unit(axis), side * to_m[axis] - half_m[axis]};
}

Vector3d mean(const Vector3d& weights, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  return weights.x() * a + weights.y() * b + weights.z() * c;
}

struct Corners {
  Vector3d a, b, c;
  Vector3d normal() const { return (b - a).cross(c - a).normalized(); }
};
Corners corners(const std::array<std::uint32_t, 3>& triangle,
                std::span<const Vector3d> vertices_m) {
  return {vertices_m[triangle[0]], vertices_m[triangle[1]], vertices_m[triangle[2]]};
}

// Barycentric weights of a point of the triangle; those of its centroid if it has no area.
Vector3d weights_of(const Corners& t, const Vector3d& p_m) {
  const Vector3d ab = t.b - t.a, ac = t.c - t.a, ap = p_m - t.a, normal = ab.cross(ac);
  const double square = normal.squaredNorm();
  if (!(square > 0)) return Vector3d::Constant(1.0 / 3);
  const double b = ap.cross(ac).dot(normal) / square, c = ab.cross(ap).dot(normal) / square;
  return {1 - b - c, b, c};
}

}  // namespace

std::optional<SolidTouch> touch_box(const Vector3d& half_m, const PathInStep& path) {
  if (!is_finite(path)) return std::nullopt;
  // The path enters the box of the particle's centers through the face that it crosses last.
  const Vector3d way_m = path.to_m - path.from_m;
  double enter = 0, leave = 1;
  int entered = -1;
  for (int axis = 0; axis < 3; ++axis) {
    const double reach_m = half_m[axis] + path.radius_m;
    const double from_m = path.from_m[axis], to_m = path.to_m[axis];
    if ((from_m >= reach_m && to_m >= reach_m) || (from_m <= -reach_m && to_m <= -reach_m))
      return std::nullopt;
    if (std::abs(from_m) > reach_m) {
      const double at = (std::copysign(reach_m, from_m) - from_m) / way_m[axis];
      if (at >= enter) enter = at, entered = axis;
    }
    if (std::abs(to_m) > reach_m)
      leave = std::min(leave, (std::copysign(reach_m, to_m) - from_m) / way_m[axis]);
  }
  if (!(enter <= leave)) return std::nullopt;
  if (entered >= 0) return face(entered, std::copysign(1, path.from_m[entered]), half_m, path.to_m);
  // It begins in the box: it is pushed to the nearest face.
  int nearest = 0;
  for (int axis = 1; axis < 3; ++axis)
    if (half_m[axis] - std::abs(path.to_m[axis]) < half_m[nearest] - std::abs(path.to_m[nearest]))
      nearest = axis;
  return face(nearest, std::copysign(1, path.to_m[nearest]), half_m, path.to_m);
}

std::optional<SolidTouch> touch_ball(double ball_radius_m, const PathInStep& path) {
  if (!is_finite(path)) return std::nullopt;
  const double reach_m = ball_radius_m + path.radius_m;
  const Vector3d way_m = path.to_m - path.from_m;
  const double square = way_m.squaredNorm(), approach = -way_m.dot(path.from_m);
  const double nearest = square > 0 ? std::clamp(approach / square, 0.0, 1.0) : 0;
  if (!((path.from_m + nearest * way_m).norm() < reach_m)) return std::nullopt;
  Vector3d normal = path.to_m;
  if (const double outside = path.from_m.squaredNorm() - reach_m * reach_m;
      outside > 0 && approach > 0) {
    // The first of the two crossings.
    const double root = std::sqrt(std::max(0.0, approach * approach - square * outside));
    normal = path.from_m + (approach - root) / square * way_m;
  }
  if (!(normal.squaredNorm() > 0)) normal = Vector3d::UnitZ();  // at the ball's center
  normal.normalize();
  return SolidTouch{normal, normal.dot(path.to_m) - ball_radius_m};
}

std::optional<MeshTouch> touch_mesh(const collision::Bvh& tree,
                                    std::span<const Vector3d> vertices_before_m, double moved_m,
                                    const PathInStep& path) {
  if (!is_finite(path)) return std::nullopt;
  const double reach_m = path.radius_m + (path.to_m - path.from_m).norm() + moved_m;
  const auto nearest = collision::nearest_point(tree, path.to_m, reach_m);
  if (!nearest) return std::nullopt;
  const std::array<std::uint32_t, 3>& triangle = tree.mesh().triangles[nearest->triangle];
  const Corners now = corners(triangle, tree.mesh().vertices_m),
                before = vertices_before_m.empty() ? now : corners(triangle, vertices_before_m);
  const Vector3d weights = weights_of(now, nearest->p_m);
  const double side_before =
      before.normal().dot(path.from_m - mean(weights, before.a, before.b, before.c));
  const Vector3d normal = std::copysign(1, side_before) * now.normal();
  const Vector3d from_surface_m = path.to_m - nearest->p_m;
  const double along_m = normal.dot(from_surface_m);
  const bool has_crossed = along_m < 0;
  if (has_crossed ? along_m > -kThrough * from_surface_m.norm()
                  : !(nearest->distance_m < path.radius_m))
    return std::nullopt;
  // In front of an edge, the particle leaves in the direction of its nearest point.
  if (!has_crossed && nearest->distance_m > 0)
    return MeshTouch{
        {from_surface_m / nearest->distance_m, nearest->distance_m}, nearest->triangle, weights};
  return MeshTouch{{normal, along_m}, nearest->triangle, weights};
}

}  // namespace fivepipe::sim
