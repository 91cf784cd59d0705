// Scenes for the tests of the simulation: virtual balls and boxes over real objects.
#pragma once
#include "sim_node/simulation/simulation.h"
#include "tests/support/collision/scene.h"

namespace fivepipe::test {

inline constexpr double kBallRadius_m = 0.06;
inline constexpr double kFrame_s = 1.0 / 30;
inline constexpr double kStep_s = 1.0 / 240;      // the default of a simulation
inline constexpr double kGravity_m_s2 = 9.80665;  // the default of a scene

inline config::SceneObject virtual_ball(const Eigen::Vector3d& center_m, double restitution = 0.5,
                                        double mass_kg = 0.2) {
  return {.name = "ball",
          .shape = config::SphereShape{kBallRadius_m},
          .world_from_object = at(center_m),
          .motion = config::Motion::dynamic,
          .reaction = config::Reaction::bounce,
          .mass_kg = mass_kg,
          .restitution = restitution};
}

inline config::SceneObject virtual_box(const std::string& name, const Eigen::Vector3d& center_m,
                                       const Eigen::Vector3d& size_m,
                                       config::Reaction reaction = config::Reaction::none) {
  return {.name = name,
          .shape = config::BoxShape{size_m},
          .world_from_object = at(center_m),
          .reaction = reaction};
}

inline config::Scene scene_of(std::vector<config::SceneObject> objects) {
  config::Scene scene;
  scene.name = "test";
  scene.objects = std::move(objects);
  return scene;
}

// Silhouettes of real capsules in five cameras with pixels of 2 mm and a field of 60 cm.
inline std::vector<hull::Silhouette> seen(const std::vector<hull::Capsule>& real) {
  return silhouettes_of(real, ring(5, 1.5, 0.35, 300, 0.6));
}

inline double mechanical_energy_J_kg(const sim::ObjectState& state, double gravity_m_s2) {
  return 0.5 * state.velocity_world_m_s.squaredNorm() +
         gravity_m_s2 * state.world_from_object.translation().z();
}

inline bool all_finite(const sim::Simulation& simulation) {
  for (const sim::ObjectState& state : simulation.states())
    if (!state.world_from_object.matrix().allFinite() || !state.velocity_world_m_s.allFinite())
      return false;
  return true;
}

}  // namespace fivepipe::test
