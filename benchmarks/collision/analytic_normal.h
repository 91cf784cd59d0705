// The surface of the hull of capsules' true silhouettes in closed form, without pixels: the
// reference for normals.
#pragma once
#include <cstddef>
#include <optional>
#include <span>

#include "common/hull/oracle/analytic.h"

namespace fivepipe::collision_bench {

struct AnalyticExit {
  double distance_m;             // along the ray
  std::size_t camera;            // the camera whose cone of sight ends there
  Eigen::Vector3d normal_world;  // unit length, pointing out of the hull
};

// Finds, by bisection, the border of the hull of the true silhouettes on a ray, between the
// distances inside_m and outside_m along it. Returns nullopt if the first point is not inside the
// hull or the second not outside.
std::optional<AnalyticExit> analytic_exit(std::span<const hull::Capsule> object,
                                          std::span<const geometry::Camera> cameras,
                                          const geometry::Ray& ray, double inside_m,
                                          double outside_m);

// Returns the unit normal, at a point on it, of the cone of sight that is tangent to the capsules:
// the direction of the shortest segment between the line of sight and the axis of the capsule that
// it touches, pointing out of the hull.
Eigen::Vector3d cone_normal(std::span<const hull::Capsule> object,
                            const Eigen::Vector3d& eye_world_m, const Eigen::Vector3d& p_world_m);

// Returns the angle between two vectors of any nonzero length.
double angle_deg(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

}  // namespace fivepipe::collision_bench
