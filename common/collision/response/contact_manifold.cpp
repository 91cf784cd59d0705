#include "common/collision/response/contact_manifold.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "common/collision/response/farthest_point_sample.h"
#include "common/collision/response/recovery.h"

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

// Steps of the descent from one point. On smooth borders the third step already changes little.
constexpr int kMaxDescents = 8;
// Size of each sample of points whose depth is computed to find the deepest point.
constexpr std::size_t kCandidates = 64;
// Smallest decrease of the exit distance that counts as progress [m]: a hundredth of what the maps
// resolve.
constexpr double kMinGain_m = 1e-6;

void check(const ObjectCollision& collision, const ManifoldRequest& request) {
  const auto finite = [](const CollisionPoint& point) { return point.p_world_m.allFinite(); };
  if (!std::all_of(collision.points.begin(), collision.points.end(), finite))
    throw std::invalid_argument("contact manifold: a collision point is not finite");
  if (!request.rp_object_world_m.allFinite())
    throw std::invalid_argument("contact manifold: the reference point is not finite");
  if (!(request.max_contacts > 0 && request.reach_m > 0 && std::isfinite(request.reach_m)))
    throw std::invalid_argument("contact manifold: max_contacts or reach_m is out of range");
}

std::vector<Vector3d> positions_of(std::span<const CollisionPoint> points) {
  std::vector<Vector3d> positions;
  for (const CollisionPoint& point : points) positions.push_back(point.p_world_m);
  return positions;
}

// Returns the distance of the last sampled point to the others. Every point is at most this far
// from the nearest sampled one, by the construction of farthest_point_sample().
double spacing_of(const std::vector<Vector3d>& positions, const std::vector<std::size_t>& sampled) {
  double spacing_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + 1 < sampled.size(); ++i)
    spacing_m = std::min(spacing_m, (positions[sampled[i]] - positions[sampled.back()]).norm());
  return spacing_m;
}

// The exit along `direction`, and the cameras that limit the hull there.
struct Exit {
  Vector3d direction;
  HullExit exit;
  std::vector<hull::LimitingCamera> limiting;
};

std::optional<Exit> exit_along(const hull::HullQuery& query, const Vector3d& p_world_m,
                               const Vector3d& direction, double reach_m) {
  const auto exit = exit_outward(query, p_world_m, direction, reach_m);
  if (!exit) return std::nullopt;
  const double outside_m = exit->distance_m + exit->error_m;
  auto limiting =
      hull::limiting_cameras(query, {p_world_m + outside_m * direction, -direction}, 0, outside_m);
  return Exit{direction, *exit,
              limiting ? std::move(limiting->cameras) : std::vector<hull::LimitingCamera>{}};
}

// Descends to an exit that none of the border normals there shortens.
Exit descend(const hull::HullQuery& query, const Vector3d& p_world_m, Exit best) {
  for (int i = 0; i < kMaxDescents; ++i) {
    std::optional<Exit> shorter;
    for (const hull::LimitingCamera& limiting : best.limiting) {
      const double best_m = (shorter ? shorter->exit : best.exit).distance_m - kMinGain_m;
      if (!(best_m > 0)) break;
      if (auto other = exit_along(query, p_world_m, limiting.normal_world, best_m))
        shorter = std::move(other);
    }
    if (!shorter) break;
    best = std::move(*shorter);
  }
  return best;
}

std::optional<Exit> first_exit(const hull::HullQuery& query, const Vector3d& p_world_m,
                               const ManifoldRequest& request) {
  const Vector3d to_reference_m = request.rp_object_world_m - p_world_m;
  if (to_reference_m.norm() > 0)
    if (auto exit = exit_along(query, p_world_m, to_reference_m.normalized(), request.reach_m))
      return exit;
  std::optional<Exit> shortest;
  for (const int axis : {2, 0, 1})
    for (const double sign : {1.0, -1.0})
      if (auto exit = exit_along(query, p_world_m, sign * Vector3d::Unit(axis),
                                 shortest ? shortest->exit.distance_m : request.reach_m))
        shortest = std::move(exit);
  return shortest;
}

Contact contact_at(const hull::HullQuery& query, const CollisionPoint& point,
                   const ManifoldRequest& request) {
  Contact contact{.on_object = point};
  auto exit = first_exit(query, point.p_world_m, request);
  if (!exit) return contact;
  *exit = descend(query, point.p_world_m, std::move(*exit));
  contact.normal_world = exit->direction;
  contact.depth_m = exit->exit.distance_m;
  contact.depth_error_m = exit->exit.error_m;
  contact.on_hull_world_m = point.p_world_m + contact.depth_m * contact.normal_world;
  contact.status = exit->limiting.empty() ? ContactStatus::no_border : ContactStatus::defined;
  if (exit->limiting.empty()) return contact;
  contact.camera = exit->limiting.front().camera;
  contact.normal_error_rad = exit->limiting.front().error_rad;
  contact.converged =
      exit->limiting.front().normal_world.dot(exit->direction) >= std::cos(kConverged_rad);
  return contact;
}

double depth_to_reference_m(const hull::HullQuery& query, const Vector3d& p_world_m,
                            const ManifoldRequest& request) {
  const Vector3d to_reference_m = request.rp_object_world_m - p_world_m;
  if (!(to_reference_m.norm() > 0)) return request.reach_m;
  const auto exit = exit_outward(query, p_world_m, to_reference_m.normalized(), request.reach_m);
  return exit ? exit->distance_m : request.reach_m;
}

// Returns the index of the deepest point towards RP_obj: first among a sample of all points, then
// among a sample of the neighbours of the deepest one.
std::size_t deepest_of(const hull::HullQuery& query, std::span<const CollisionPoint> points,
                       const std::vector<Vector3d>& positions, double min_m,
                       const ManifoldRequest& request) {
  const std::size_t farthest =
      std::size_t(&cp_object(query, points, request.rp_object_world_m) - points.data());
  std::size_t deepest = farthest;
  double depth_m = 0;
  const auto take = [&](std::size_t i) {
    if (const double candidate_m = depth_to_reference_m(query, positions[i], request);
        candidate_m > depth_m)
      deepest = i, depth_m = candidate_m;
  };
  const auto coarse = farthest_point_sample(positions, {farthest}, kCandidates, min_m);
  for (const std::size_t i : coarse) take(i);
  const double spacing_m = spacing_of(positions, coarse);
  std::vector<Vector3d> near;
  std::vector<std::size_t> index;
  const Vector3d center = positions[deepest];
  for (std::size_t i = 0; i < positions.size(); ++i)
    if ((positions[i] - center).norm() <= spacing_m)
      near.push_back(positions[i]), index.push_back(i);
  const std::size_t first =
      std::size_t(std::find(index.begin(), index.end(), deepest) - index.begin());
  for (const std::size_t i : farthest_point_sample(near, {first}, kCandidates, min_m))
    take(index[i]);
  return deepest;
}

// Returns the points that contains() confirms, sorted so that the given order does not matter.
std::vector<CollisionPoint> points_in_hull(const hull::HullQuery& query,
                                           std::span<const CollisionPoint> given) {
  const std::vector<Vector3d> positions = positions_of(given);
  std::vector<std::uint8_t> inside(given.size());
  query.contains(positions, inside);
  std::vector<CollisionPoint> points;
  for (std::size_t i = 0; i < given.size(); ++i)
    if (inside[i]) points.push_back(given[i]);
  std::sort(points.begin(), points.end(), precedes);
  return points;
}

}  // namespace

ContactManifold contact_manifold(const hull::HullQuery& query, const ObjectCollision& collision,
                                 const ManifoldRequest& request) {
  check(collision, request);
  const std::vector<CollisionPoint> points = points_in_hull(query, collision.points);
  ContactManifold manifold;
  if (points.empty()) return manifold;
  const double footprint_m = pixel_footprint_m(query, points.front().p_world_m);
  const std::vector<Vector3d> positions = positions_of(points);
  const std::size_t deepest = deepest_of(query, points, positions, footprint_m, request);
  for (const std::size_t i :
       farthest_point_sample(positions, {deepest}, std::size_t(request.max_contacts), footprint_m))
    manifold.contacts.push_back(contact_at(query, points[i], request));
  return manifold;
}

}  // namespace fivepipe::collision
