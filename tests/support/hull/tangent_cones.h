// The hull of a real ball, without pixels.
#pragma once
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "common/geometry/camera.h"

namespace fivepipe::test {

// The intersection of the cones that touch the ball.
struct TangentCones {
  std::vector<geometry::Camera> cameras;
  Eigen::Vector3d center_m;
  double radius_m;

  Eigen::Vector3d nearest_on_cone(const geometry::Camera& camera,
                                  const Eigen::Vector3d& p_m) const {
    const Eigen::Vector3d eye_m = camera.camera_from_world.inverse().translation(),
                          to_m = center_m - eye_m, axis = to_m.normalized(), q_m = p_m - eye_m;
    const double half_rad = std::asin(radius_m / to_m.norm());
    const double along_m = q_m.dot(axis);
    const Eigen::Vector3d across_m = q_m - along_m * axis;
    if (across_m.norm() <= along_m * std::tan(half_rad)) return p_m;
    const Eigen::Vector3d side =
        std::cos(half_rad) * axis + std::sin(half_rad) * across_m.normalized();
    return eye_m + std::max(0.0, q_m.dot(side)) * side;
  }
  // Dykstra's projection onto the intersection of convex sets (1983).
  Eigen::Vector3d nearest(const Eigen::Vector3d& p_m) const {
    std::vector<Eigen::Vector3d> corrections(cameras.size(), Eigen::Vector3d::Zero());
    Eigen::Vector3d x = p_m;
    for (int i = 0; i < 2000; ++i)
      for (std::size_t c = 0; c < cameras.size(); ++c) {
        const Eigen::Vector3d y = x + corrections[c];
        x = nearest_on_cone(cameras[c], y);
        corrections[c] = y - x;
      }
    return x;
  }
};

inline double between_deg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi;
}

}  // namespace fivepipe::test
