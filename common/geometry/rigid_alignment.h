// The rigid motion that brings points onto measured ones.
#pragma once
#include <Eigen/Geometry>
#include <span>
#include <vector>

namespace fivepipe::geometry {

struct RigidAlignment {
  Eigen::Isometry3d to_from = Eigen::Isometry3d::Identity();
  std::vector<double> residuals_m;  // distance of each moved point from its measured one
  double rms_m = 0;                 // of the residuals
};

// Least squares without scale or reflection (Umeyama 1991). Throws std::invalid_argument if there
// are fewer than three pairs, a coordinate is not finite, or the points are nearly on a line: their
// extent across it (second singular value) is at most a hundredth of that along it.
RigidAlignment align_points(std::span<const Eigen::Vector3d> from,
                            std::span<const Eigen::Vector3d> to);

}  // namespace fivepipe::geometry
