// Where a ray meets a triangle, in double: what tests and benchmarks compare drawn images with. It
// shares no code with the renderer.
#pragma once
#include <array>
#include <optional>

#include "common/geometry/camera.h"

namespace fivepipe::render {

// Where a ray meets the plane of a triangle.
struct PlaneHit {
  double distance;              // ray parameter
  Eigen::Vector3d barycentric;  // of the triangle's corners; all >= 0 inside the triangle
  bool is_from_back;            // the corners appear clockwise
};

// Returns nullopt if the ray is parallel to the triangle. The hit may be outside the triangle and
// behind the ray's origin.
std::optional<PlaneHit> plane_hit(const std::array<Eigen::Vector3d, 3>& corners_world_m,
                                  const geometry::Ray& ray);

// Below this volume of the parallelepiped of the ray and two edges [m^3, for rays of unit depth],
// the ray counts as parallel to the triangle.
inline constexpr double kParallel_m3 = 1e-12;

}  // namespace fivepipe::render
