#include "tests/study/truth/cone_hull.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <queue>
#include <stdexcept>

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

constexpr double kConeInfinity = std::numeric_limits<double>::infinity();
// Cells whose half diagonal is smaller, as a fraction of the tolerance, are not divided.
constexpr double kSmallest = 0.02;
// Bound of the rounding of the distances below, at most some metres long.
constexpr double kConeRounding_m = 1e-12;

// Distance of the segment a-b from the half-line from the origin along the unit vector e. The
// squared distance is convex in both parameters, so clamping one and solving for the other twice
// gives the minimum (Ericson, Real-Time Collision Detection, 5.1.9).
double distance_to_half_line(const Vector3d& a, const Vector3d& b, const Vector3d& e) {
  const Vector3d d = b - a;
  const double dd = d.squaredNorm(), de = d.dot(e), across = dd - de * de;
  double s = across > 0 ? std::clamp((a.dot(e) * de - a.dot(d)) / across, 0.0, 1.0) : 0.0;
  double t = (a + s * d).dot(e);
  if (t < 0) {
    t = 0;
    s = dd > 0 ? std::clamp(-a.dot(d) / dd, 0.0, 1.0) : 0.0;
  }
  return (a + s * d - t * e).norm();
}

}  // namespace

CapsuleCone::CapsuleCone(const hull::Capsule& capsule, const Vector3d& eye_world_m)
    : a_m_(capsule.a_world_m - eye_world_m),
      b_m_(capsule.b_world_m - eye_world_m),
      radius_m_(capsule.radius_m),
      farthest_m_(std::max(a_m_.norm(), b_m_.norm())) {}

// The sight to a point of the ball turns by at most asin(radius / distance). A turn by an angle
// moves the point of the sight that is nearest to a point q of the segment, which is at most |q|
// from the eye, by at most 2 sin(angle / 2) |q|.
bool CapsuleCone::misses(const Vector3d& p_m, double ball_radius_m) const {
  const double distance_m = p_m.norm();
  if (!(distance_m > ball_radius_m)) return false;
  const double chord = 2 * std::sin(0.5 * std::asin(ball_radius_m / distance_m));
  return distance_to_half_line(a_m_, b_m_, p_m / distance_m) >
         radius_m_ + farthest_m_ * chord + kConeRounding_m;
}

// The faces of the cone are planes through the eye and an edge of the box, with the whole box on
// one side.
BoxCone::BoxCone(const geometry::OrientedBox& box, const Vector3d& eye_world_m) {
  std::array<Vector3d, 8> corners;
  for (std::size_t i = 0; i < 8; ++i)
    corners[i] = box.world_from_box * box.half_m.cwiseProduct(Vector3d(
                                          i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1)) -
                 eye_world_m;
  for (std::size_t i = 0; i < 8; ++i)
    for (const std::size_t bit : {1u, 2u, 4u}) {
      if (i & bit) continue;
      const Vector3d normal = corners[i].cross(corners[i | bit]).normalized();
      for (const Vector3d& n : {normal, Vector3d(-normal)})
        if (std::ranges::all_of(corners,
                                [&](const Vector3d& c) { return n.dot(c) <= kConeRounding_m; }))
          outward_.push_back(n);
    }
  if (outward_.size() < 3) throw std::invalid_argument("the camera is in the box");
}

bool BoxCone::misses(const Vector3d& p_m, double ball_radius_m) const {
  return std::ranges::any_of(
      outward_, [&](const Vector3d& n) { return n.dot(p_m) > ball_radius_m + kConeRounding_m; });
}

ConeHull::ConeHull(std::span<const capture::SyntheticPart> parts,
                   std::span<const geometry::Camera> cameras) {
  for (const geometry::Camera& camera : cameras) {
    View view{geometry::camera_center_world_m(camera), {}};
    for (const capture::SyntheticPart& part : parts)
      if (const auto* capsule = std::get_if<hull::Capsule>(&part.shape))
        view.cones.emplace_back(CapsuleCone(*capsule, view.eye_world_m));
      else
        view.cones.emplace_back(
            BoxCone(std::get<geometry::OrientedBox>(part.shape), view.eye_world_m));
    views_.push_back(std::move(view));
  }
}

// Removes the cones that miss the ball. Returns false if a camera has none left: the ball is not in
// the hull.
bool ConeHull::narrow(Candidates& candidates, const Vector3d& center_m, double radius_m) const {
  for (std::size_t i = 0; i < views_.size(); ++i) {
    std::erase_if(candidates[i], [&](int cone) {
      return std::visit(
          [&](const auto& c) { return c.misses(center_m - views_[i].eye_world_m, radius_m); },
          views_[i].cones[std::size_t(cone)]);
    });
    if (candidates[i].empty()) return false;
  }
  return true;
}

bool ConeHull::contains(const Vector3d& p_world_m) const {
  return !views_.empty() && std::ranges::all_of(views_, [&](const View& view) {
    return std::ranges::any_of(view.cones, [&](const auto& cone) {
      return std::visit([&](const auto& c) { return !c.misses(p_world_m - view.eye_world_m, 0); },
                        cone);
    });
  });
}

ConeHull::Bound ConeHull::highest(const BoxOnAxis& box, const SpacingInterval& heights,
                                  double tolerance_m) const {
  struct Cell {
    Vector3d low_m, high_m;  // frame of the box
    std::shared_ptr<const Candidates> parents;
    bool operator<(const Cell& other) const { return high_m.z() < other.high_m.z(); }
  };
  Candidates all(views_.size());
  for (std::size_t i = 0; i < views_.size(); ++i)
    for (std::size_t cone = 0; cone < views_[i].cones.size(); ++cone) all[i].push_back(int(cone));
  std::priority_queue<Cell> cells;
  cells.push({Vector3d(-box.half_m.x(), -box.half_m.y(), heights.low_m),
              Vector3d(box.half_m.x(), box.half_m.y(), heights.high_m),
              std::make_shared<const Candidates>(std::move(all))});
  double known_m = -kConeInfinity;
  while (!cells.empty()) {
    const Cell cell = cells.top();
    cells.pop();
    const Vector3d center_m = 0.5 * (cell.low_m + cell.high_m), half_m = center_m - cell.low_m;
    // No point is known in cells that are much smaller if the hull there is nearly a point.
    if (cell.high_m.z() - std::max(known_m, heights.low_m) <= tolerance_m ||
        half_m.norm() < kSmallest * tolerance_m)
      return {known_m, cell.high_m.z()};
    Candidates candidates = *cell.parents;
    const Vector3d center_world_m = box.world_from_box * center_m;
    if (!narrow(candidates, center_world_m, half_m.norm())) continue;
    if (center_m.z() > known_m && contains(center_world_m)) known_m = center_m.z();
    const auto shared = std::make_shared<const Candidates>(std::move(candidates));
    // Cells become cubes.
    std::vector<Cell> halves{{cell.low_m, cell.high_m, shared}};
    for (int axis = 0; axis < 3; ++axis) {
      if (half_m[axis] < 0.5 * half_m.maxCoeff()) continue;
      for (std::size_t i = 0, n = halves.size(); i < n; ++i) {
        Cell upper = halves[i];
        upper.low_m[axis] = halves[i].high_m[axis] = center_m[axis];
        halves.push_back(upper);
      }
    }
    for (Cell& half : halves) cells.push(std::move(half));
  }
  return {known_m, std::max(known_m, heights.low_m)};
}

ConeHull::Bound ConeHull::lowest(const BoxOnAxis& box, const SpacingInterval& heights,
                                 double tolerance_m) const {
  BoxOnAxis turned = box;  // by half a turn about x
  turned.world_from_box.linear() = box.world_from_box.linear() * Vector3d(1, -1, -1).asDiagonal();
  const Bound bound = highest(turned, {-heights.high_m, -heights.low_m}, tolerance_m);
  return {-bound.max_m, -bound.min_m};
}

}  // namespace fivepipe::test
