#include "common/collision/proximity/moving_triangle.h"

#include <cmath>

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

// A point with barycentric weights this far below 0 counts as in the triangle, so that no path
// passes between two adjacent triangles. Rounding changes a weight by about 1e-16.
constexpr double kBesideTriangle = 1e-9;

Triangle between(const MovingTriangle& triangle, double at) {
  Triangle t;
  for (std::size_t i = 0; i < t.size(); ++i)
    t[i] = triangle.before[i] + at * (triangle.now[i] - triangle.before[i]);
  return t;
}

}  // namespace

Vector3d unit_normal(const Triangle& triangle) {
  return (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).normalized();
}

Vector3d barycentric_weights(const Triangle& triangle, const Vector3d& p) {
  const Vector3d ab = triangle[1] - triangle[0], ac = triangle[2] - triangle[0],
                 ap = p - triangle[0], normal = ab.cross(ac);
  const double square = normal.squaredNorm();
  if (!(square > 0)) return Vector3d::Constant(1.0 / 3);
  const double b = ap.cross(ac).dot(normal) / square, c = ab.cross(ap).dot(normal) / square;
  return {1 - b - c, b, c};
}

std::optional<TriangleCrossing> crossing(const MovingTriangle& triangle, const Vector3d& before,
                                         const Vector3d& now) {
  const double from = unit_normal(triangle.before).dot(before - triangle.before[0]),
               to = unit_normal(triangle.now).dot(now - triangle.now[0]);
  const bool changes_side = from > 0 ? to <= 0 : from < 0 && to >= 0;
  if (!changes_side) return std::nullopt;
  const double at = from / (from - to);
  const Vector3d weights = barycentric_weights(between(triangle, at), before + at * (now - before));
  if (!(weights.minCoeff() >= -kBesideTriangle)) return std::nullopt;
  return TriangleCrossing{at, weights, std::copysign(1, from)};
}

}  // namespace fivepipe::collision
