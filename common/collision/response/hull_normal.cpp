#include "common/collision/response/hull_normal.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

// Sine of the angle between IJ and KL below which they count as parallel: sampling steps of 0.1 mm
// leave coordinates of about a metre four digits.
constexpr double kParallelSine = 1e-4;

// Returns a unit vector perpendicular to v. Deterministic.
Vector3d unit_across(const Vector3d& v) {
  Eigen::Index axis = 0;
  v.cwiseAbs().minCoeff(&axis);
  return v.cross(Vector3d::Unit(axis)).normalized();
}

NormalStatus certain_enough(double error_rad) {
  return error_rad <= kMaxNormalError_rad ? NormalStatus::defined : NormalStatus::too_uncertain;
}

}  // namespace

HullNormal four_point_normal(const hull::HullQuery& query, const Recovery& recovery,
                             const ResponseConfig& config) {
  const Vector3d& a_world_m = recovery.cp_object_world_m;
  const Vector3d across = unit_across(recovery.v_rec_world),
                 across_too = recovery.v_rec_world.cross(across);
  const double slope = std::tan(0.5 * config.apex_angle_rad);
  const double edge_m = recovery.reach_m * std::hypot(1.0, slope);
  std::array<Vector3d, 4> ijkl_world_m;
  double step_m = 0;
  HullNormal found;
  for (int i = 0; i < 4; ++i) {
    const Vector3d& sideways = i < 2 ? across : across_too;
    const Vector3d along_edge =
        (recovery.v_rec_world + (i % 2 ? slope : -slope) * sideways).normalized();
    const auto exit = config.search == HullSearch::sampled
                          ? exit_sampled(query, a_world_m, along_edge, edge_m, config.window_px)
                          : exit_from_base(query, a_world_m, along_edge, edge_m);
    if (!exit) {
      found.status = NormalStatus::edge_starts_inside;
      return found;
    }
    step_m = std::max(step_m, exit->error_m);
    ijkl_world_m[std::size_t(i)] = a_world_m + exit->distance_m * along_edge;
  }
  const Vector3d ij_m = ijkl_world_m[1] - ijkl_world_m[0], kl_m = ijkl_world_m[3] - ijkl_world_m[2];
  const Vector3d normal = ij_m.cross(kl_m);
  if (!(normal.norm() > kParallelSine * ij_m.norm() * kl_m.norm())) {
    found.status = NormalStatus::parallel;
    return found;
  }
  found.normal_world = (normal.dot(recovery.v_rec_world) < 0 ? -normal : normal).normalized();
  // Each difference of two points is uncertain by a step along the edges and by a pixel of the
  // maps. The two differences tilt the normal about perpendicular axes, hence sqrt(2).
  const double uncertain_m =
      step_m +
      pixel_footprint_m(query, a_world_m + recovery.exit.distance_m * recovery.v_rec_world);
  found.error_rad =
      std::atan(std::numbers::sqrt2 * uncertain_m / std::min(ij_m.norm(), kl_m.norm()));
  found.status = certain_enough(found.error_rad);
  return found;
}

HullNormal closed_form_normal(const hull::HullQuery& query, const Recovery& recovery) {
  const double outside_m = recovery.exit.distance_m + recovery.exit.error_m;
  const geometry::Ray inward{recovery.cp_object_world_m + outside_m * recovery.v_rec_world,
                             -recovery.v_rec_world};
  HullNormal found;
  auto limiting = hull::limiting_cameras(query, inward, 0, outside_m);
  if (!limiting) {
    found.status = NormalStatus::no_border;
    return found;
  }
  found.cameras = std::move(limiting->cameras);
  found.normal_world = found.cameras.front().normal_world;
  found.error_rad = found.cameras.front().error_rad;
  found.status = certain_enough(found.error_rad);
  return found;
}

}  // namespace fivepipe::collision
