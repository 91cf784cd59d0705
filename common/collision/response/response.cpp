#include "common/collision/response/response.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "common/collision/response/hull_normal.h"
#include "common/collision/response/recovery.h"

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

void check(const ObjectCollision& collision, const ResponseRequest& request, const Requery& requery,
           const ResponseConfig& config) {
  const auto finite = [](const CollisionPoint& point) { return point.p_world_m.allFinite(); };
  if (!std::all_of(collision.points.begin(), collision.points.end(), finite))
    throw std::invalid_argument("response: a collision point is not finite");
  if (!request.rp_object_world_m.allFinite())
    throw std::invalid_argument("response: the reference point is not finite");
  if (!(request.equally_far_m >= 0))
    throw std::invalid_argument("response: equally_far_m is negative or NaN");
  if (!(config.height_m > 0 && std::isfinite(config.height_m) && config.apex_angle_rad > 0 &&
        config.apex_angle_rad < std::numbers::pi && config.window_px > 0))
    throw std::invalid_argument("response: height_m, apex_angle_rad or window_px is out of range");
  if (!requery) throw std::invalid_argument("response: requery is empty");
}

std::optional<HullExit> find_exit(const hull::HullQuery& query, const Vector3d& cp_world_m,
                                  const Vector3d& v_rec, double reach_m,
                                  const ResponseConfig& config) {
  switch (config.search) {
    case HullSearch::from_reference: return exit_from_base(query, cp_world_m, v_rec, reach_m);
    case HullSearch::outward: return exit_outward(query, cp_world_m, v_rec, reach_m);
    case HullSearch::sampled:
      return exit_sampled(query, cp_world_m, v_rec, reach_m, config.window_px);
  }
  return std::nullopt;
}

void query_moved(const hull::HullQuery& query, const Requery& requery, double height_m,
                 Response& response) {
  response.remaining_points = requery(response.clear_distance_m() * response.v_rec_world).points;
  response.residual_m =
      residual_m(query, response.remaining_points, response.v_rec_world, height_m);
  response.status = response.residual_m <= response.indifferent_m()
                        ? RecoveryStatus::recovered
                        : RecoveryStatus::still_colliding;
}

}  // namespace

Response respond(const hull::HullQuery& query, const ObjectCollision& collision,
                 const ResponseRequest& request, const Requery& requery,
                 const ResponseConfig& config) {
  check(collision, request, requery, config);
  Response response;
  if (collision.points.empty()) {
    response.status = RecoveryStatus::no_collision_point;
    return response;
  }
  const CollisionPoint& cp =
      cp_object(query, collision.points, request.rp_object_world_m, request.equally_far_m);
  response.cp_object_world_m = cp.p_world_m;

  const Vector3d to_reference_m = request.rp_object_world_m - cp.p_world_m;
  if (!request.v_rec_world && config.search != HullSearch::outward &&
      query.contains(request.rp_object_world_m)) {  // includes RP_obj = CP_obj
    response.status = RecoveryStatus::reference_inside;
    return response;
  }
  const Vector3d direction = request.v_rec_world.value_or(to_reference_m);
  // stableNorm: the square of the given length may underflow or overflow.
  if (!direction.allFinite() || !(direction.stableNorm() > 0))
    return response;  // direction_undefined
  response.v_rec_world = direction.stableNormalized();
  const double reach_m =
      request.v_rec_world ? config.height_m : std::min(config.height_m, to_reference_m.norm());
  const auto exit = find_exit(query, cp.p_world_m, response.v_rec_world, reach_m, config);
  if (!exit) {
    response.status = RecoveryStatus::no_exit_within_reach;
    return response;
  }
  response.d_rec_m = exit->distance_m;
  response.d_rec_error_m = exit->error_m;
  response.cp_hull_world_m = cp.p_world_m + exit->distance_m * response.v_rec_world;
  response.pixel_footprint_m = pixel_footprint_m(query, response.cp_hull_world_m);
  const Recovery recovery{cp.p_world_m, response.v_rec_world, reach_m, *exit};
  if (request.normals.four_points)
    response.four_points = four_point_normal(query, recovery, config);
  if (request.normals.closed_form) response.closed_form = closed_form_normal(query, recovery);
  query_moved(query, requery, reach_m, response);
  return response;
}

}  // namespace fivepipe::collision
