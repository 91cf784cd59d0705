#include "benchmarks/collision/analytic_normal.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace fivepipe::collision_bench {

using Eigen::Vector3d;

Vector3d cone_normal(std::span<const hull::Capsule> object, const Vector3d& eye_world_m,
                     const Vector3d& p_world_m) {
  const Vector3d sight = (p_world_m - eye_world_m).normalized();
  const auto across = [&](const Vector3d& v) { return Vector3d(v - v.dot(sight) * sight); };
  double min_m = std::numeric_limits<double>::infinity();
  Vector3d normal = Vector3d::Zero();
  for (const hull::Capsule& c : object) {
    const Vector3d a = across(c.a_world_m - eye_world_m), along = across(c.b_world_m - c.a_world_m);
    const double length2 = along.squaredNorm();
    const Vector3d nearest =
        a + (length2 > 0 ? std::clamp(-a.dot(along) / length2, 0.0, 1.0) : 0.0) * along;
    if (!(nearest.norm() - c.radius_m < min_m)) continue;
    min_m = nearest.norm() - c.radius_m;
    normal = -nearest.normalized();
  }
  return normal;
}

std::optional<AnalyticExit> analytic_exit(std::span<const hull::Capsule> object,
                                          std::span<const geometry::Camera> cameras,
                                          const geometry::Ray& ray, double inside_m,
                                          double outside_m) {
  const auto at = [&](double m) { return Vector3d(ray.origin_world_m + m * ray.direction_world); };
  if (!hull::in_analytic_hull(object, cameras, at(inside_m)) ||
      hull::in_analytic_hull(object, cameras, at(outside_m)))
    return std::nullopt;
  constexpr double kRounding_m = 1e-12;
  while (std::abs(outside_m - inside_m) > kRounding_m) {
    const double center_m = 0.5 * (inside_m + outside_m);
    (hull::in_analytic_hull(object, cameras, at(center_m)) ? inside_m : outside_m) = center_m;
  }
  for (std::size_t i = 0; i < cameras.size(); ++i)
    if (!hull::in_analytic_hull(object, {&cameras[i], 1}, at(outside_m)))
      return AnalyticExit{
          inside_m, i,
          cone_normal(object, geometry::camera_center_world_m(cameras[i]), at(outside_m))};
  return std::nullopt;
}

double angle_deg(const Vector3d& a, const Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi;
}

}  // namespace fivepipe::collision_bench
