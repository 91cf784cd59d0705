// Rotation vectors: the axis times the angle.
#pragma once
#include <Eigen/Geometry>

namespace fivepipe::collision {

// Returns the matrix of a rotation vector [rad].
inline Eigen::Matrix3d rotation(const Eigen::Vector3d& turn_rad) {
  const double angle = turn_rad.norm();
  return angle > 0 ? Eigen::AngleAxisd(angle, turn_rad / angle).toRotationMatrix()
                   : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
}

}  // namespace fivepipe::collision
