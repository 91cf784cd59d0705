// Objects in rigid contact with the hull, for the tests of the simulation.
#pragma once
#include <cmath>
#include <numbers>

#include "tests/support/sim_scene.h"

namespace fivepipe::test {

inline config::SceneObject touching(config::SceneObject object) {
  object.motion = config::Motion::dynamic;
  object.reaction = config::Reaction::contact;
  return object;
}

inline config::SceneObject touching_ball(const Eigen::Vector3d& center_m, double radius_m,
                                         double restitution, double friction = 0) {
  config::SceneObject ball = touching(virtual_ball(center_m, restitution));
  ball.shape = config::SphereShape{radius_m, 4};
  ball.friction = friction;
  return ball;
}

// A real block with its top at z = 0, seen by five cameras at that height: the top of the hull is
// flat. A pixel's footprint is 2 mm.
inline std::vector<hull::Silhouette> real_block() {
  return silhouettes_of_box(
      Eigen::AlignedBox3d(Eigen::Vector3d(-0.08, -0.08, -0.1), Eigen::Vector3d(0.08, 0.08, 0)),
      ring(5, 1.5, 0, 300, 0.6));
}

inline Eigen::Vector3d center_m(const sim::Simulation& simulation, std::size_t object = 0) {
  return simulation.states()[object].world_from_object.translation();
}
inline Eigen::Vector3d velocity_m_s(const sim::Simulation& simulation, std::size_t object = 0) {
  return simulation.states()[object].velocity_world_m_s;
}

inline constexpr double kDegree_rad = std::numbers::pi / 180;

// A door leaf of 80 x 4 x 100 cm. Its hinge is 40 cm to the left of its centre.
inline config::SceneObject door(double to_deg = 100) {
  config::SceneObject door =
      virtual_box("door", kOrigin, {0.8, 0.04, 1.0}, config::Reaction::contact);
  door.motion = config::Motion::dynamic;
  door.mass_kg = 5;
  door.friction = 0;
  door.restitution = 0;
  door.joint = config::Joint{.kind = config::JointKind::hinge,
                             .point_m = {-0.4, 0, 0},
                             .axis = {0, 0, 1},
                             .lowest = 0,
                             .highest = to_deg * kDegree_rad,
                             .damping_1_s = 0.5};
  return door;
}

inline double angle_rad(const Eigen::Isometry3d& pose) {
  return std::atan2(pose(1, 0), pose(0, 0));
}

}  // namespace fivepipe::test
