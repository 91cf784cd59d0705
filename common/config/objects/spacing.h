// How far an experimenter may move a fixed object of the scene while the deployment runs.
#pragma once
#include <Eigen/Core>

namespace fivepipe::config {

struct Spacing {
  Eigen::Vector3d axis_world = Eigen::Vector3d::UnitX();  // unit; a larger spacing moves along it
  double at_m = 0;               // the spacing in the scene's pose of the object
  double low_m = 0, high_m = 0;  // the permitted spacings: low_m <= at_m <= high_m, low_m < high_m

  // The object's move from the scene's pose [m, world].
  Eigen::Vector3d move_world_m(double spacing_m) const { return (spacing_m - at_m) * axis_world; }
  // False also for NaN.
  bool permits(double spacing_m) const { return spacing_m >= low_m && spacing_m <= high_m; }
};

// A longer way than this is probably a unit mistake.
inline constexpr double kMaxSpacing_m = 100;

}  // namespace fivepipe::config
