#include "tests/study/truth/spacing_truth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace fivepipe::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Roots of a t^2 + b t + c.
std::vector<double> roots(double a, double b, double c) {
  if (a == 0) return b == 0 ? std::vector<double>{} : std::vector<double>{-c / b};
  const double discriminant = b * b - 4 * a * c;
  if (!(discriminant >= 0)) return {};
  const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
  return q == 0 ? std::vector<double>{0} : std::vector<double>{q / a, c / q};
}

// The largest height of the capsule (frame of the box) in the prism |x| <= half.x, |y| <= half.y;
// -infinity if it is nowhere there.
//
// The capsule is the union of balls at p(t) = a + t (b - a). That at t reaches the height
//   h(t) = p_z(t) + sqrt(r^2 - d^2(t)),
// d being the distance of p(t) from the prism. Between the places at which p(t) crosses the planes
// of the prism's faces, d^2 is one quadratic q(t), and h' = 0 gives
//   p_z'^2 * 4 (r^2 - q) = q'^2,
// a quadratic equation. h is concave, so its maximum is there or at an end of a piece.
double highest(const hull::Capsule& capsule, const Vector2d& half) {
  const Vector3d from = capsule.a_world_m, along = capsule.b_world_m - from;
  const double r2 = capsule.radius_m * capsule.radius_m;
  std::vector<double> ends{0, 1};
  for (int axis = 0; axis < 2; ++axis)
    for (const double side : {-half[axis], half[axis]})
      if (along[axis] != 0) {
        const double t = (side - from[axis]) / along[axis];
        if (t > 0 && t < 1) ends.push_back(t);
      }
  std::ranges::sort(ends);
  const auto distance2 = [&](double t) {
    const Vector2d p = from.head<2>() + t * along.head<2>();
    return (p.cwiseAbs() - half).cwiseMax(0).squaredNorm();
  };
  double highest_m = -kInfinity;
  const auto consider = [&](double t) {
    const double below2 = r2 - distance2(t);
    if (below2 >= 0) highest_m = std::max(highest_m, from.z() + t * along.z() + std::sqrt(below2));
  };
  for (std::size_t i = 0; i < ends.size(); ++i) {
    consider(ends[i]);
    if (i == 0) continue;
    // q(t) = alpha t^2 + beta t + gamma on this piece.
    const double middle = 0.5 * (ends[i - 1] + ends[i]);
    double alpha = 0, beta = 0, gamma = 0;
    for (int axis = 0; axis < 2; ++axis) {
      const double p = from[axis] + middle * along[axis];
      if (std::abs(p) <= half[axis]) continue;
      const double offset = from[axis] - std::copysign(half[axis], p);
      alpha += along[axis] * along[axis];
      beta += 2 * along[axis] * offset;
      gamma += offset * offset;
    }
    const double m2 = along.z() * along.z();
    std::vector<double> candidates = roots(4 * alpha * (m2 + alpha), 4 * beta * (m2 + alpha),
                                           4 * m2 * (gamma - r2) + beta * beta);
    // Where the balls leave the prism, the piece ends.
    for (const double t : roots(alpha, beta, gamma - r2)) candidates.push_back(t);
    for (const double t : candidates)
      if (t > ends[i - 1] && t < ends[i]) {
        consider(t);
        if (std::abs(r2 - distance2(t)) < 1e-12 * r2)  // on the border, where rounding may miss
          highest_m = std::max(highest_m, from.z() + t * along.z());
      }
  }
  return highest_m;
}

// Clips a convex polygon to sign * p[axis] <= limit (Sutherland and Hodgman, 1974).
std::vector<Vector3d> clipped(const std::vector<Vector3d>& polygon, int axis, double sign,
                              double limit) {
  std::vector<Vector3d> inside;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector3d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double da = sign * a[axis] - limit, db = sign * b[axis] - limit;
    if (da <= 0) inside.push_back(a);
    if ((da < 0 && db > 0) || (da > 0 && db < 0)) inside.emplace_back(a + da / (da - db) * (b - a));
  }
  return inside;
}

// The same for a box: the extremes of a convex polyhedron are at its corners, and those of the
// clipped box are the corners of its clipped faces.
double highest(const geometry::OrientedBox& box, const Vector2d& half) {
  double highest_m = -kInfinity;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0}) {
      std::vector<Vector3d> face;
      for (const auto& [u, v] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
        Vector3d corner;
        corner[axis] = side;
        corner[(axis + 1) % 3] = u;
        corner[(axis + 2) % 3] = v;
        face.emplace_back(box.world_from_box * box.half_m.cwiseProduct(corner));
      }
      for (int plane = 0; plane < 2; ++plane)
        for (const double sign : {-1.0, 1.0}) face = clipped(face, plane, sign, half[plane]);
      for (const Vector3d& corner : face) highest_m = std::max(highest_m, corner.z());
    }
  return highest_m;
}

}  // namespace

BoxOnAxis box_on_axis(const Eigen::Isometry3d& world_from_box, const Vector3d& size_m,
                      const Vector3d& axis_world) {
  const Vector3d axis = world_from_box.linear().transpose() * axis_world.normalized();
  Eigen::Index z = 0;
  axis.cwiseAbs().maxCoeff(&z);
  constexpr double kParallel = 1e-9;
  if (!(std::abs(axis[z]) > 1 - kParallel))
    throw std::invalid_argument("the axis is not parallel to an edge of the box");
  Eigen::Matrix3d turned = Eigen::Matrix3d::Zero();
  turned((z + 1) % 3, 0) = 1;
  turned((z + 2) % 3, 1) = axis[z] > 0 ? 1 : -1;
  turned(z, 2) = axis[z] > 0 ? 1 : -1;
  BoxOnAxis box{world_from_box,
                0.5 * Vector3d(size_m[(z + 1) % 3], size_m[(z + 2) % 3], size_m[z])};
  box.world_from_box.linear() = world_from_box.linear() * turned;
  return box;
}

std::optional<SpacingInterval> heights_in_prism(const BoxOnAxis& box,
                                                const capture::SyntheticPart& part) {
  const capture::SyntheticPart local = moved(box.world_from_box.inverse(Eigen::Isometry), part);
  Eigen::Isometry3d turned = Eigen::Isometry3d::Identity();  // by half a turn about x
  turned.linear().diagonal() = Vector3d(1, -1, -1);
  const auto top = [&](const capture::SyntheticPart& p) {
    return std::visit([&](const auto& shape) { return highest(shape, box.half_m.head<2>()); },
                      p.shape);
  };
  const double high_m = top(local), low_m = -top(moved(turned, local));
  if (!(low_m <= high_m)) return std::nullopt;
  return SpacingInterval{low_m, high_m};
}

std::vector<SpacingInterval> colliding_spacings(const BoxOnAxis& box,
                                                std::span<const capture::SyntheticPart> parts) {
  std::vector<SpacingInterval> intervals;
  for (const capture::SyntheticPart& part : parts)
    if (const auto heights = heights_in_prism(box, part))
      intervals.push_back({heights->low_m - box.half_m.z(), heights->high_m + box.half_m.z()});
  return united(std::move(intervals));
}

std::vector<SpacingInterval> united(std::vector<SpacingInterval> intervals) {
  std::ranges::sort(intervals, {}, &SpacingInterval::low_m);
  std::vector<SpacingInterval> joined;
  for (const SpacingInterval& i : intervals)
    if (!joined.empty() && i.low_m <= joined.back().high_m)
      joined.back().high_m = std::max(joined.back().high_m, i.high_m);
    else
      joined.push_back(i);
  return joined;
}

std::vector<SpacingInterval> complement(std::span<const SpacingInterval> intervals,
                                        const SpacingInterval& range) {
  std::vector<SpacingInterval> rest;
  double from_m = range.low_m;
  for (const SpacingInterval& i : intervals) {
    if (i.low_m > from_m && from_m < range.high_m)
      rest.push_back({from_m, std::min(i.low_m, range.high_m)});
    from_m = std::max(from_m, i.high_m);
  }
  if (from_m < range.high_m) rest.push_back({from_m, range.high_m});
  return rest;
}

}  // namespace fivepipe::test
