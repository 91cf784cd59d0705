#include "benchmarks/render/oracle/triangle_ray.h"

#include <cmath>

namespace fivepipe::render {

// origin + d * direction = p0 + b1 (p1 - p0) + b2 (p2 - p0), by Cramer's rule
std::optional<PlaneHit> plane_hit(const std::array<Eigen::Vector3d, 3>& p_m,
                                  const geometry::Ray& ray) {
  const Eigen::Vector3d side1 = p_m[1] - p_m[0], side2 = p_m[2] - p_m[0],
                        from = ray.origin_world_m - p_m[0], across = side1.cross(side2),
                        turned = from.cross(ray.direction_world);
  const double determinant = -ray.direction_world.dot(across);
  if (!(std::abs(determinant) >= kParallel_m3)) return std::nullopt;
  const double b1 = side2.dot(turned) / determinant, b2 = -side1.dot(turned) / determinant;
  return PlaneHit{from.dot(across) / determinant, {1 - b1 - b2, b1, b2}, determinant < 0};
}

}  // namespace fivepipe::render
