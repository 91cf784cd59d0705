// Continuous collision detection of a point with a triangle. Each vertex and the point move at a
// constant velocity within a step. Coordinates are in one frame [m].
#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>

#include "common/collision/detection/triangle.h"

namespace fivepipe::collision {

// Returns the corners of a mesh's triangle whose vertices have moved to vertices_m.
inline Triangle corners(const std::array<std::uint32_t, 3>& triangle,
                        std::span<const Eigen::Vector3d> vertices_m) {
  return {vertices_m[triangle[0]], vertices_m[triangle[1]], vertices_m[triangle[2]]};
}

// Returns the unit normal (b - a) x (c - a); zero if the triangle has no area.
Eigen::Vector3d unit_normal(const Triangle& triangle);

// Returns the barycentric weights of the point of the triangle's plane that is nearest to p; those
// of the centroid if the triangle has no area.
Eigen::Vector3d barycentric_weights(const Triangle& triangle, const Eigen::Vector3d& p);

struct MovingTriangle {
  Triangle before, now;  // at the start and at the end of the step
};
struct TriangleCrossing {
  double at;                // 0 to 1 of the step
  Eigen::Vector3d weights;  // of the crossed point
  double side;              // of the point at the start: 1: the normal's side; -1: the other one
};
// Returns the crossing of a point that moves from `before` to `now` with the triangle. Returns
// nullopt if there is none, if the point starts on the triangle's plane, or if a coordinate is not
// finite. A point that ends on the plane has crossed it. The signed distance to the plane counts as
// linear in time, which is exact if the triangle does not turn.
std::optional<TriangleCrossing> crossing(const MovingTriangle& triangle,
                                         const Eigen::Vector3d& before, const Eigen::Vector3d& now);

}  // namespace fivepipe::collision
