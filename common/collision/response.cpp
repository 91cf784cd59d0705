#include "common/collision/response.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace fivepipe {
namespace {

// Sine of the angle between IJ and KL below which they count as parallel: coordinates of metres at steps of 0.1 mm keep four digits.
constexpr double kParallelSine = 1e-4;

using Silhouettes = std::span<const Silhouette>;

// Of equally far points, the one farthest from leaving the hull on its way to rp; depths in steps of step_m.
const CollisionPoint& farthest_from(Silhouettes silhouettes, const ResponseRequest& request, std::span<const CollisionPoint> points, double step_m) {
  const Eigen::Vector3d& rp_world_m = request.rp_object_world_m;
  const auto distance_m = [&](const CollisionPoint& point) { return (point.p_world_m - rp_world_m).norm(); };
  const auto farther = [&](const CollisionPoint& a, const CollisionPoint& b) { return distance_m(a) < distance_m(b); };
  const CollisionPoint* chosen = &*std::max_element(points.begin(), points.end(), farther);  // the first of equals
  if (request.equally_far_m == 0) return *chosen;
  const double least_m = distance_m(*chosen) - request.equally_far_m;
  double depth_m = 0;
  for (const CollisionPoint& point : points) {
    const double way_m = distance_m(point);
    const Eigen::Vector3d to_reference = (rp_world_m - point.p_world_m) / way_m;
    while (way_m >= least_m && depth_m + step_m < way_m && in_hull(silhouettes, point.p_world_m + (depth_m + step_m) * to_reference)) {
      depth_m += step_m;
      chosen = &point;
    }
  }
  return *chosen;
}

// The first of `samples` pixel centres between outside and inside that is in the hull; `inside`, which is, if none before it.
Eigen::Vector3d first_in_hull(Silhouettes silhouettes, const Eigen::Vector3d& outside_world_m, const Eigen::Vector3d& inside_world_m, int samples) {
  for (int i = 0; i < samples; ++i) {
    const Eigen::Vector3d p_world_m = outside_world_m + (i + 0.5) / samples * (inside_world_m - outside_world_m);
    if (in_hull(silhouettes, p_world_m)) return p_world_m;
  }
  return inside_world_m;
}

// Across a unit vector, always the same one.
Eigen::Vector3d unit_across(const Eigen::Vector3d& v) {
  Eigen::Index axis = 0;
  v.cwiseAbs().minCoeff(&axis);
  return v.cross(Eigen::Vector3d::Unit(axis)).normalized();
}

double largest_pixel_m(Silhouettes silhouettes, const Eigen::Vector3d& p_world_m) {
  double footprint_m = 0;
  for (const Silhouette& s : silhouettes)
    footprint_m = std::max(footprint_m, (s.camera.camera_from_world * p_world_m).z() / std::min(s.camera.pinhole.fx_px, s.camera.pinhole.fy_px));
  return footprint_m;
}

// Points I, J, K, L and their normal. `reach_m` is the height of ABC and DAE.
void find_normal(Silhouettes silhouettes, const ResponseConfig& config, double reach_m, Response& response) {
  const Eigen::Vector3d& a_world_m = response.cp_object_world_m;
  const Eigen::Vector3d base_world_m = a_world_m + reach_m * response.v_rec_world;
  const Eigen::Vector3d across = unit_across(response.v_rec_world), across_too = response.v_rec_world.cross(across);
  const double half_base_m = reach_m * std::tan(0.5 * config.apex_angle_rad);
  std::array<Eigen::Vector3d, 4> ijkl_world_m;
  const std::array<Eigen::Vector3d, 4> bcde_world_m = {base_world_m - half_base_m * across, base_world_m + half_base_m * across,
                                                       base_world_m - half_base_m * across_too, base_world_m + half_base_m * across_too};
  for (int i = 0; i < 4; ++i) {
    if (in_hull(silhouettes, bcde_world_m[i])) {
      response.normal = NormalStatus::edge_starts_inside;
      return;
    }
    ijkl_world_m[i] = first_in_hull(silhouettes, bcde_world_m[i], a_world_m, config.window_px);
  }
  const Eigen::Vector3d ij_m = ijkl_world_m[1] - ijkl_world_m[0], kl_m = ijkl_world_m[3] - ijkl_world_m[2];
  const Eigen::Vector3d normal = ij_m.cross(kl_m);
  if (!(normal.norm() > kParallelSine * ij_m.norm() * kl_m.norm())) {
    response.normal = NormalStatus::parallel;
    return;
  }
  response.n_hull_world = (normal.dot(response.v_rec_world) < 0 ? -normal : normal).normalized();
  // Each difference of two points is uncertain by a step along the edges and by a pixel of the maps; two such tilts, across each other.
  const double edge_step_m = reach_m / std::cos(0.5 * config.apex_angle_rad) / config.window_px;
  const double uncertain_m = edge_step_m + response.pixel_footprint_m;
  response.n_hull_error_rad = std::atan(std::numbers::sqrt2 * uncertain_m / std::min(ij_m.norm(), kl_m.norm()));
  response.normal = response.n_hull_error_rad <= kMaxNormalErrorRad ? NormalStatus::defined : NormalStatus::too_uncertain;
}

// How much farther along V_rec until each point has been outside at a tested step; `reach_m` where one has not.
double residual_m(Silhouettes silhouettes, std::span<const CollisionPoint> points, const Eigen::Vector3d& v_rec_world, double step_m, double reach_m) {
  double moved_m = 0;
  for (const CollisionPoint& point : points)
    while (in_hull(silhouettes, point.p_world_m + moved_m * v_rec_world)) {
      moved_m += step_m;
      if (moved_m >= reach_m) return reach_m;
    }
  return moved_m;
}

void query_moved(TriangleVolumeQuery& query, std::span<const Triangle> object_world_m, double reach_m, Response& response) {
  const Eigen::Vector3d move_m = response.clear_distance_m() * response.v_rec_world;
  std::vector<Triangle> moved(object_world_m.begin(), object_world_m.end());
  for (Triangle& triangle : moved)
    for (Eigen::Vector3d& v : triangle) v += move_m;
  response.points_left = query.query(moved).points;
  response.residual_m = residual_m(query.silhouettes(), response.points_left, response.v_rec_world, response.d_rec_error_m, reach_m);
  const double indifferent_m = response.d_rec_error_m + response.pixel_footprint_m;
  response.status = response.residual_m <= indifferent_m ? RecoveryStatus::recovered : RecoveryStatus::still_colliding;
}

void check(const ObjectCollision& collision, const ResponseRequest& request, const ResponseConfig& config) {
  if (collision.points.empty()) throw std::invalid_argument("response for an object without collision points");
  if (!request.rp_object_world_m.allFinite() || (request.v_rec_world && !request.v_rec_world->allFinite()))
    throw std::invalid_argument("reference point or recovery vector is not finite");
  if (!(request.equally_far_m >= 0)) throw std::invalid_argument("equally_far_m is negative or not a number");
  if (!(config.height_m > 0 && std::isfinite(config.height_m) && config.apex_angle_rad > 0 && config.apex_angle_rad < std::numbers::pi && config.window_px > 0))
    throw std::invalid_argument("height, angle or window of the response out of range");
}

}  // namespace

Response respond(TriangleVolumeQuery& query, std::span<const Triangle> object_world_m, const ObjectCollision& collision,
                 const ResponseRequest& request, const ResponseConfig& config) {
  check(collision, request, config);
  const Silhouettes silhouettes = query.silhouettes();
  const CollisionPoint& cp_object = farthest_from(silhouettes, request, collision.points, config.height_m / config.window_px);
  Response response;
  response.cp_object_world_m = cp_object.p_world_m;
  response.cp_object_triangle = cp_object.triangle;

  const Eigen::Vector3d to_reference_m = request.rp_object_world_m - cp_object.p_world_m;
  const Eigen::Vector3d direction = request.v_rec_world.value_or(to_reference_m);
  if (!request.v_rec_world && in_hull(silhouettes, request.rp_object_world_m)) {  // RP_obj = CP_obj among them
    response.status = RecoveryStatus::reference_inside;
    return response;
  }
  // Stable: the square of the given length must neither vanish nor overflow.
  if (!(direction.stableNorm() > 0)) return response;  // direction_undefined
  response.v_rec_world = direction.stableNormalized();
  const double reach_m = request.v_rec_world ? config.height_m : std::min(config.height_m, to_reference_m.norm());
  const Eigen::Vector3d base_world_m = cp_object.p_world_m + reach_m * response.v_rec_world;
  if (in_hull(silhouettes, base_world_m)) {
    response.status = RecoveryStatus::no_exit_within_reach;
    return response;
  }
  response.cp_hull_world_m = first_in_hull(silhouettes, base_world_m, cp_object.p_world_m, config.window_px);
  response.d_rec_m = (response.cp_hull_world_m - cp_object.p_world_m).norm();
  response.d_rec_error_m = reach_m / config.window_px;
  response.pixel_footprint_m = largest_pixel_m(silhouettes, response.cp_hull_world_m);
  if (request.normal_wanted) find_normal(silhouettes, config, reach_m, response);
  query_moved(query, object_world_m, reach_m, response);
  return response;
}

}  // namespace fivepipe
