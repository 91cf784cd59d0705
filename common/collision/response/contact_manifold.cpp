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

std::vector<Vector3d> positions_m(std::span<const CollisionPoint> points) {
  std::vector<Vector3d> places;
  for (const CollisionPoint& point : points) places.push_back(point.p_world_m);
  return places;
}

// Returns the distance of the last sampled point to the others. Every point is at most this far
// from the nearest sampled one, by the construction of farthest_point_sample().
double spacing_of(const std::vector<Vector3d>& places, const std::vector<std::size_t>& taken) {
  double spacing_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + 1 < taken.size(); ++i)
    spacing_m = std::min(spacing_m, (places[taken[i]] - places[taken.back()]).norm());
  return spacing_m;
}

// The exit along `direction`, and the cameras that limit the hull there.
struct Way {
  Vector3d direction;
  HullExit exit;
  std::vector<hull::LimitingCamera> limiting;
};

std::optional<Way> way_along(const hull::HullQuery& query, const Vector3d& p_world_m,
                             const Vector3d& direction, double reach_m) {
  const auto exit = exit_outward(query, p_world_m, direction, reach_m);
  if (!exit) return std::nullopt;
  const double outside_m = exit->distance_m + exit->error_m;
  auto limiting =
      hull::limiting_cameras(query, {p_world_m + outside_m * direction, -direction}, 0, outside_m);
  return Way{direction, *exit,
             limiting ? std::move(limiting->cameras) : std::vector<hull::LimitingCamera>{}};
}

// Descends to an exit that none of the border normals there shortens.
Way descend(const hull::HullQuery& query, const Vector3d& p_world_m, Way way) {
  for (int i = 0; i < kMaxDescents; ++i) {
    std::optional<Way> shorter;
    for (const hull::LimitingCamera& limiting : way.limiting) {
      const double best_m = (shorter ? shorter->exit : way.exit).distance_m - kMinGain_m;
      if (!(best_m > 0)) break;
      if (auto other = way_along(query, p_world_m, limiting.normal_world, best_m))
        shorter = std::move(other);
    }
    if (!shorter) break;
    way = std::move(*shorter);
  }
  return way;
}

std::optional<Way> first_way(const hull::HullQuery& query, const Vector3d& p_world_m,
                             const ManifoldRequest& request) {
  const Vector3d to_reference_m = request.rp_object_world_m - p_world_m;
  if (to_reference_m.norm() > 0)
    if (auto way = way_along(query, p_world_m, to_reference_m.normalized(), request.reach_m))
      return way;
  std::optional<Way> shortest;
  for (const int axis : {2, 0, 1})
    for (const double sign : {1.0, -1.0})
      if (auto way = way_along(query, p_world_m, sign * Vector3d::Unit(axis),
                               shortest ? shortest->exit.distance_m : request.reach_m))
        shortest = std::move(way);
  return shortest;
}

Contact contact_at(const hull::HullQuery& query, const CollisionPoint& point,
                   const ManifoldRequest& request) {
  Contact contact{.on_object = point};
  auto way = first_way(query, point.p_world_m, request);
  if (!way) return contact;
  *way = descend(query, point.p_world_m, std::move(*way));
  contact.normal_world = way->direction;
  contact.depth_m = way->exit.distance_m;
  contact.depth_error_m = way->exit.error_m;
  contact.on_hull_world_m = point.p_world_m + contact.depth_m * contact.normal_world;
  contact.status = way->limiting.empty() ? ContactStatus::no_border : ContactStatus::defined;
  if (way->limiting.empty()) return contact;
  contact.camera = way->limiting.front().camera;
  contact.normal_error_rad = way->limiting.front().error_rad;
  contact.converged =
      way->limiting.front().normal_world.dot(way->direction) >= std::cos(kConverged_rad);
  return contact;
}

double depth_to_reference_m(const hull::HullQuery& query, const Vector3d& p_world_m,
                            const ManifoldRequest& request) {
  const Vector3d way_m = request.rp_object_world_m - p_world_m;
  if (!(way_m.norm() > 0)) return request.reach_m;
  const auto exit = exit_outward(query, p_world_m, way_m.normalized(), request.reach_m);
  return exit ? exit->distance_m : request.reach_m;
}

// Returns the index of the deepest point towards RP_obj: first among a sample of all points, then
// among a sample of the neighbours of the deepest one.
std::size_t deepest_of(const hull::HullQuery& query, std::span<const CollisionPoint> points,
                       const std::vector<Vector3d>& places, double min_m,
                       const ManifoldRequest& request) {
  const std::size_t farthest =
      std::size_t(&cp_object(query, points, request.rp_object_world_m) - points.data());
  std::size_t deepest = farthest;
  double depth_m = 0;
  const auto take = [&](std::size_t i) {
    if (const double candidate_m = depth_to_reference_m(query, places[i], request);
        candidate_m > depth_m)
      deepest = i, depth_m = candidate_m;
  };
  const auto coarse = farthest_point_sample(places, farthest, kCandidates, min_m);
  for (const std::size_t i : coarse) take(i);
  const double spacing_m = spacing_of(places, coarse);
  std::vector<Vector3d> near;
  std::vector<std::size_t> index;
  const Vector3d middle = places[deepest];
  for (std::size_t i = 0; i < places.size(); ++i)
    if ((places[i] - middle).norm() <= spacing_m) near.push_back(places[i]), index.push_back(i);
  const std::size_t first =
      std::size_t(std::find(index.begin(), index.end(), deepest) - index.begin());
  for (const std::size_t i : farthest_point_sample(near, first, kCandidates, min_m)) take(index[i]);
  return deepest;
}

// Returns the points that contains() confirms, sorted so that the given order does not matter.
std::vector<CollisionPoint> points_in_hull(const hull::HullQuery& query,
                                           std::span<const CollisionPoint> given) {
  const std::vector<Vector3d> places = positions_m(given);
  std::vector<std::uint8_t> inside(given.size());
  query.contains(places, inside);
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
  ContactManifold manifold{.contacts = {}, .points_in_hull = points.size()};
  if (points.empty()) return manifold;
  const double footprint_m = pixel_footprint_m(query, points.front().p_world_m);
  const std::vector<Vector3d> places = positions_m(points);
  const std::size_t deepest = deepest_of(query, points, places, footprint_m, request);
  for (const std::size_t i :
       farthest_point_sample(places, deepest, std::size_t(request.max_contacts), footprint_m))
    manifold.contacts.push_back(contact_at(query, points[i], request));
  return manifold;
}

}  // namespace fivepipe::collision
