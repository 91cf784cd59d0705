// What the fuzzers check of each decoded pose.
#pragma once
#include <Eigen/Geometry>

namespace fivepipe::fuzz {

// Of the elements of R R^T - I: the rounding of quaternions that are normalised in double, and
// more.
inline constexpr double kRotationError = 1e-9;

// A rotation and a translation.
inline bool is_rigid(const Eigen::Isometry3d& pose) {
  const Eigen::Matrix3d r = pose.linear();
  return pose.matrix().allFinite() && (r * r.transpose()).isIdentity(kRotationError) &&
         r.determinant() > 0;
}

}  // namespace fivepipe::fuzz
