// How a dynamic object of the scene is connected with the world.
#pragma once
#include <Eigen/Core>

namespace fivepipe::config {

// hinge: turns about an axis, as a door; slider: moves along an axis, as a drawer.
enum class JointKind { hinge, slider };

struct Joint {
  JointKind kind = JointKind::hinge;
  Eigen::Vector3d point_m = Eigen::Vector3d::Zero();  // hinge: a point of the axis; object frame
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();    // object frame, unit
  // Limits relative to the start, which is 0 [hinge: rad, right-handed about the axis; slider: m].
  // lowest <= 0 <= highest, lowest < highest.
  double lowest = 0, highest = 0;
  double damping_1_s = 0.5;  // deceleration divided by the velocity
};

// A hinge's largest turn to either side, because angles are computed from poses.
inline constexpr double kMaxHinge_deg = 170;

}  // namespace fivepipe::config
