#include "common/collision/response/recovery.h"

#include <algorithm>
#include <tuple>

#include "common/hull/image_cone.h"

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

// Returns the exit with the distance to either side at which contains() confirms it.
HullExit verified(const hull::HullQuery& query, const Vector3d& p_world_m,
                  const Vector3d& direction_world, double distance_m) {
  double error_m = kMinRounding_m;
  const auto inside = [&](double at_m) {
    return query.contains(p_world_m + at_m * direction_world);
  };
  while (error_m < kMaxRounding_m &&
         (inside(distance_m + error_m) || !inside(std::max(0.0, distance_m - error_m))))
    error_m *= 2;
  return {distance_m, std::min(error_m, kMaxRounding_m)};
}

double first_exit_m(const hull::HullQuery& query, const Vector3d& p_world_m,
                    const Vector3d& direction_world, double reach_m) {
  const auto found = query.intervals({p_world_m, direction_world}, 0, reach_m);
  // If the first interval begins later, p is outside the hull.
  return found.empty() || found.front().enter > kMaxRounding_m ? 0 : found.front().leave;
}

}  // namespace

bool precedes(const CollisionPoint& a, const CollisionPoint& b) {
  const auto key = [](const CollisionPoint& point) {
    return std::tuple(point.triangle, point.p_world_m.x(), point.p_world_m.y(),
                      point.p_world_m.z());
  };
  return key(a) < key(b);
}

const CollisionPoint& cp_object(const hull::HullQuery& query,
                                std::span<const CollisionPoint> points, const Vector3d& rp_world_m,
                                double equally_far_m) {
  const auto distance_m = [&](const CollisionPoint& point) {
    return (point.p_world_m - rp_world_m).norm();
  };
  const CollisionPoint* chosen = &points.front();
  for (const CollisionPoint& point : points) {
    const double more_m = distance_m(point) - distance_m(*chosen);
    if (more_m > 0 || (more_m == 0 && precedes(point, *chosen))) chosen = &point;
  }
  if (equally_far_m == 0) return *chosen;
  const double min_m = distance_m(*chosen) - equally_far_m;
  double depth_m = 0;
  for (const CollisionPoint& point : points) {
    const double to_reference_m = distance_m(point);
    if (!(to_reference_m >= min_m && to_reference_m > 0)) continue;
    const double point_depth_m = first_exit_m(
        query, point.p_world_m, (rp_world_m - point.p_world_m) / to_reference_m, to_reference_m);
    if (point_depth_m > depth_m ||
        (point_depth_m == depth_m && depth_m > 0 && precedes(point, *chosen)))
      chosen = &point, depth_m = point_depth_m;
  }
  return *chosen;
}

std::optional<HullExit> exit_outward(const hull::HullQuery& query, const Vector3d& p_world_m,
                                     const Vector3d& direction_world, double reach_m) {
  const double distance_m = first_exit_m(query, p_world_m, direction_world, reach_m);
  if (distance_m >= reach_m) return std::nullopt;
  return verified(query, p_world_m, direction_world, distance_m);
}

std::optional<HullExit> exit_from_base(const hull::HullQuery& query, const Vector3d& p_world_m,
                                       const Vector3d& direction_world, double reach_m) {
  const Vector3d base_world_m = p_world_m + reach_m * direction_world;
  if (query.contains(base_world_m)) return std::nullopt;
  const double entry_m =
      query.first_entry({base_world_m, -direction_world}, 0, reach_m).value_or(reach_m);
  return verified(query, p_world_m, direction_world, reach_m - entry_m);
}

std::optional<HullExit> exit_sampled(const hull::HullQuery& query, const Vector3d& p_world_m,
                                     const Vector3d& direction_world, double reach_m, int samples) {
  if (query.contains(p_world_m + reach_m * direction_world)) return std::nullopt;
  const double step_m = reach_m / samples;
  for (int i = samples - 1; i >= 0; --i) {
    const double distance_m = (i + 0.5) * step_m;
    if (query.contains(p_world_m + distance_m * direction_world))
      return HullExit{distance_m, step_m};
  }
  return HullExit{0, step_m};
}

double residual_m(const hull::HullQuery& query, std::span<const CollisionPoint> points,
                  const Vector3d& direction_world, double reach_m) {
  double farthest_m = 0;
  for (const CollisionPoint& point : points)
    farthest_m =
        std::max(farthest_m, first_exit_m(query, point.p_world_m, direction_world, reach_m));
  return farthest_m;
}

double pixel_footprint_m(const hull::HullQuery& query, const Vector3d& p_world_m) {
  double of_all_m = 0, of_seeing_m = 0;
  for (const hull::CpuHull::MapCamera& c : query.hull().cameras()) {
    const double footprint_m = (c.camera.camera_from_world * p_world_m).z() /
                               std::min(c.camera.pinhole.fx_px, c.camera.pinhole.fy_px);
    of_all_m = std::max(of_all_m, footprint_m);
    if (query.hull().rule().limits == hull::Limits::all) continue;
    const auto uv_px = geometry::project(c.camera, p_world_m);
    if (uv_px && hull::holds(hull::image_of(c.camera), uv_px->x(), uv_px->y()))
      of_seeing_m = std::max(of_seeing_m, footprint_m);
  }
  return of_seeing_m > 0 ? of_seeing_m : of_all_m;
}

}  // namespace fivepipe::collision
