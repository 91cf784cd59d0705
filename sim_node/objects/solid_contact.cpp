#include "sim_node/objects/solid_contact.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "common/collision/proximity/moving_triangle.h"
#include "common/collision/proximity/nearest_point.h"

namespace fivepipe::sim {
namespace {

using collision::corners;
using collision::Triangle;
using Eigen::Vector3d;

bool is_finite(const PathInStep& path) { return path.from_m.allFinite() && path.to_m.allFinite(); }

SolidContact face(int axis, double side, const Vector3d& half_m, const Vector3d& to_m) {
  return {side * Vector3d::Unit(axis), side * to_m[axis] - half_m[axis]};
}

// The crossing of a path with a triangle of a mesh.
struct Crossing {
  collision::TriangleCrossing crossing;
  std::uint32_t triangle;
};
std::optional<Crossing> first_crossing(const collision::Bvh& tree,
                                       std::span<const Vector3d> vertices_before_m, double moved_m,
                                       const PathInStep& path) {
  Eigen::AlignedBox3d box_m(path.from_m);
  box_m.extend(path.to_m);
  box_m = {box_m.min().array() - moved_m, box_m.max().array() + moved_m};
  std::optional<Crossing> first;
  collision::each_triangle_near(tree, box_m, [&](std::uint32_t triangle) {
    const Triangle now = corners(tree.mesh().triangles[triangle], tree.mesh().vertices_m);
    const Triangle before = vertices_before_m.empty()
                                ? now
                                : corners(tree.mesh().triangles[triangle], vertices_before_m);
    const auto found = collision::crossing({before, now}, path.from_m, path.to_m);
    if (found &&
        (!first || std::tie(found->at, triangle) < std::tie(first->crossing.at, first->triangle)))
      first = {*found, triangle};
  });
  return first;
}

}  // namespace

std::optional<SolidContact> box_contact(const Vector3d& half_m, const PathInStep& path) {
  if (!is_finite(path)) return std::nullopt;
  // The path enters the box of the point's places through the face that it crosses last.
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
  // The path begins within the radius of the box: often at a face that has stopped the point, and
  // that stops it however deep it ends.
  int outside = 0;
  for (int axis = 1; axis < 3; ++axis)
    if (std::abs(path.from_m[axis]) - half_m[axis] >
        std::abs(path.from_m[outside]) - half_m[outside])
      outside = axis;
  if (std::abs(path.from_m[outside]) >= half_m[outside])
    return face(outside, std::copysign(1, path.from_m[outside]), half_m, path.to_m);
  // The path begins in the box: the nearest face pushes the point out.
  int nearest = 0;
  for (int axis = 1; axis < 3; ++axis)
    if (half_m[axis] - std::abs(path.to_m[axis]) < half_m[nearest] - std::abs(path.to_m[nearest]))
      nearest = axis;
  return face(nearest, std::copysign(1, path.to_m[nearest]), half_m, path.to_m);
}

std::optional<SolidContact> ball_contact(double ball_radius_m, const PathInStep& path) {
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
  } else if (path.from_m.norm() >= ball_radius_m && !(normal.dot(path.from_m) > 0)) {
    normal = path.from_m;  // it begins at the surface and ends beyond the centre
  }
  if (!(normal.squaredNorm() > 0)) normal = Vector3d::UnitZ();  // at the ball's center
  normal.normalize();
  return SolidContact{normal, normal.dot(path.to_m) - ball_radius_m};
}

std::optional<MeshContact> mesh_contact(const collision::Bvh& tree,
                                        std::span<const Vector3d> vertices_before_m, double moved_m,
                                        const PathInStep& path) {
  if (!is_finite(path)) return std::nullopt;
  if (const auto first = first_crossing(tree, vertices_before_m, moved_m, path)) {
    const Triangle now = corners(tree.mesh().triangles[first->triangle], tree.mesh().vertices_m);
    const Vector3d normal = first->crossing.side * collision::unit_normal(now);
    return MeshContact{
        {normal, normal.dot(path.to_m - now[0])}, first->triangle, first->crossing.weights};
  }
  const auto nearest = collision::nearest_point(tree, path.to_m, path.radius_m);
  // On the surface itself the direction is undefined.
  if (!nearest || !(nearest->distance_m > 0)) return std::nullopt;
  const Triangle now = corners(tree.mesh().triangles[nearest->triangle], tree.mesh().vertices_m);
  return MeshContact{{(path.to_m - nearest->p_m) / nearest->distance_m, nearest->distance_m},
                     nearest->triangle,
                     collision::barycentric_weights(now, nearest->p_m)};
}

}  // namespace fivepipe::sim
