#include "benchmarks/collision/baselines/rendered_response.h"

#include <algorithm>
#include <cmath>

namespace fivepipe::baselines {
namespace {

using Eigen::Vector3d;

// Returns the farthest point along the line among those at most aside_m from it, or the line's
// start if there is none.
Vector3d last_point_along(const std::vector<collision::CollisionPoint>& points,
                          const Vector3d& start, const Vector3d& direction, double aside_m) {
  double farthest_m = 0;
  Vector3d found = start;
  for (const collision::CollisionPoint& point : points) {
    const Vector3d p = point.p_world_m - start;
    const double along_m = p.dot(direction);
    if (along_m > farthest_m && (p - along_m * direction).norm() <= aside_m)
      farthest_m = along_m, found = point.p_world_m;
  }
  return found;
}

}  // namespace

std::optional<RenderedExit> RenderedResponse::respond(const Vector3d& a, const Vector3d& v_rec,
                                                      double height_m, double apex_angle_rad) {
  Eigen::Index axis = 0;
  v_rec.cwiseAbs().minCoeff(&axis);
  const Vector3d across = v_rec.cross(Vector3d::Unit(axis)).normalized(),
                 across2 = v_rec.cross(across);
  const double half_base_m = height_m * std::tan(0.5 * apex_angle_rad),
               edge_m = std::hypot(height_m, half_base_m);
  const double row_m = 2 * half_base_m * height_m / std::max(edge_m, 2 * half_base_m) / window_px_;
  RenderedExit exit;
  Vector3d spans[2];  // IJ, KL
  for (const int second : {0, 1}) {
    const Vector3d& sideways = second ? across2 : across;
    const Vector3d to_b = height_m * v_rec - half_base_m * sideways,
                   to_c = height_m * v_rec + half_base_m * sideways;
    const auto points =
        query_.query(std::vector<collision::Triangle>{{a, a + to_b, a + to_c}}).points;
    if (!second) {
      exit.cp_hull_world_m =
          last_point_along(points, a, v_rec, 0.51 * row_m);  // 0.01 rows allow for rounding
      exit.d_rec_m = (exit.cp_hull_world_m - a).norm();
      const double step_m = edge_m / window_px_;
      if (exit.d_rec_m > height_m - 1.5 * step_m) return std::nullopt;
    }
    // The centers of the outermost pixels are up to one row inside an edge.
    spans[second] = last_point_along(points, a, to_c.normalized(), 1.01 * row_m) -
                    last_point_along(points, a, to_b.normalized(), 1.01 * row_m);
  }
  constexpr double kParallelSine = 1e-4;  // as in hull_normal.cpp
  const Vector3d normal = spans[0].cross(spans[1]);
  if (normal.norm() > kParallelSine * spans[0].norm() * spans[1].norm())
    exit.normal_world = (normal.dot(v_rec) < 0 ? -normal : normal).normalized();
  return exit;
}

}  // namespace fivepipe::baselines
