// The shipped scenes with rigid contact: the simulation against the silhouettes of their actors in
// their cameras.
#include <algorithm>

#include "tests/support/capture/actor_silhouettes.h"
#include "tests/support/sim_scene.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

// Returns a shipped deployment, with each object that moves displaced.
config::Deployment shipped(const std::string& name, const Vector3d& displaced_m) {
  config::Deployment deployment = config::load_deployment(
      std::filesystem::path(FIVEPIPE_SOURCE_DIR) / "launch/deployments" / (name + ".yaml"));
  for (config::SceneObject& object : deployment.scene.objects)
    if (object.motion != config::Motion::fixed)
      object.world_from_object.translation() += displaced_m;
  return deployment;
}

// The simulation of a shipped deployment over its actor's period.
class Scene {
 public:
  explicit Scene(const std::string& name, const Vector3d& displaced_m = Vector3d::Zero())
      : deployment_(shipped(name, displaced_m)),
        cameras_(cameras_of(deployment_.rig)),
        simulation_(deployment_.scene, {}, deployment_.rig.volume_m) {
    world_ = config::capture_of_all_nodes(deployment_).synthetic;
  }

  // Calls seen(time_s) after each frame.
  template <class Seen>
  void play(const Seen& seen) {
    const double frame_s = 1 / deployment_.frame_rate_hz;
    for (int frame = 0; frame * frame_s < world_.period_s; ++frame) {
      silhouettes_ = silhouettes_of(capture::synthetic_parts(world_, frame * frame_s), cameras_);
      simulation_.advance_to(frame * frame_s, silhouettes_);
      seen(frame * frame_s);
    }
  }

  sim::ObjectState state(const std::string& object) const {
    for (const sim::ObjectState& state : simulation_.states())
      if (state.name == object) return state;
    ADD_FAILURE() << "no object " << object;
    return {};
  }
  Vector3d place_m(const std::string& object) const {
    return state(object).world_from_object.translation();
  }
  const sim::Simulation& simulation() const { return simulation_; }
  const std::vector<hull::Silhouette>& silhouettes() const { return silhouettes_; }

 private:
  config::Deployment deployment_;
  std::vector<geometry::Camera> cameras_;
  sim::Simulation simulation_;
  config::SyntheticWorld world_;
  std::vector<hull::Silhouette> silhouettes_;
};

TEST(ShippedScenes, BlocksStackBounceAndAreThrown) {
  Scene blocks("blocks");
  const std::vector<std::string> stack = {"lower_cube", "middle_cube", "upper_cube"};
  std::vector<Vector3d> placed_m;  // after the first second
  double highest_m = 0, fastest_m_s = 0, before_m_s = 0;
  int bounces = 0;
  blocks.play([&](double time_s) {
    // The tray is lowered from 2.88 s on.
    if (time_s < 2.8)
      for (const collision::TrackedComponent& component : *blocks.simulation().hull_components())
        if (component.motion) {
          EXPECT_LT(component.motion->velocity_world_m_s.norm(), 1e-3) << time_s;
          EXPECT_LT(component.motion->angular_velocity_world_rad_s.norm(), 1e-3) << time_s;
        }
    if (time_s >= 1 && placed_m.empty())
      for (const std::string& cube : stack) placed_m.push_back(blocks.place_m(cube));
    // A ball may bump into it.
    for (std::size_t i = 0; i < placed_m.size(); ++i) {
      const Vector3d moved_m = blocks.place_m(stack[i]) - placed_m[i];
      EXPECT_LT(std::abs(moved_m.z()), 0.003) << stack[i] << " at " << time_s << " s";
      EXPECT_LT(moved_m.norm(), 0.02) << stack[i] << " at " << time_s << " s";
    }
    highest_m = std::max(highest_m, blocks.place_m("thrown_cube").z());
    fastest_m_s = std::max(fastest_m_s, blocks.state("thrown_cube").velocity_world_m_s.z());
    const double v_m_s = blocks.state("bouncing_ball").velocity_world_m_s.x();
    bounces += v_m_s * before_m_s < 0;
    if (v_m_s != 0) before_m_s = v_m_s;
  });
  EXPECT_GE(bounces, 3) << "between the real blocks";
  // Between two frames the tray moves at up to 1.32 m/s. The arm with the tray, as one rigid body,
  // would move at less than 1 m/s.
  EXPECT_GT(fastest_m_s, 1.05);
  EXPECT_LT(fastest_m_s, 1.6);
  // The tray throws it at 1.4 m/s from z 0.19 m: 10 cm higher.
  EXPECT_GT(highest_m, 0.19 + 0.03 + 0.06);
  EXPECT_LT(highest_m, 0.19 + 0.03 + 0.20);
  // It falls back on the tray, or beside it on the table.
  EXPECT_LT(blocks.place_m("thrown_cube").z(), 0.21);
  EXPECT_LT(blocks.state("thrown_cube").velocity_world_m_s.norm(), 0.01);
  EXPECT_EQ(blocks.simulation().counters().respawned, 0u);
}

double angle_deg(const Scene& door) {
  const Eigen::Matrix3d turned = door.state("door").world_from_object.linear();
  return std::atan2(turned(1, 0), turned(0, 0)) * 180 / std::numbers::pi;
}

TEST(ShippedScenes, TheDoorIsPushedOpenAndCloses) {
  Scene door("door");
  double widest_deg = 0;
  door.play([&](double time_s) {
    EXPECT_GE(angle_deg(door), -1e-6) << time_s;
    EXPECT_LE(angle_deg(door), 110 + 1e-6) << time_s;
    widest_deg = std::max(widest_deg, angle_deg(door));
  });
  EXPECT_GT(widest_deg, 30);
  EXPECT_LT(angle_deg(door), 5) << "it has closed";
}

// Many distances in a contact on a flat face are equal. If rounding chose among them, a picometre
// would change the door's angle by degrees.
TEST(ShippedScenes, TheDoorTurnsTheSameIfItStartsAPicometreAside) {
  Scene door("door"), displaced("door", {1e-12, 0, 0});
  std::vector<double> angles_deg;
  door.play([&](double) { angles_deg.push_back(angle_deg(door)); });
  std::size_t frame = 0;
  displaced.play([&](double time_s) {
    EXPECT_NEAR(angle_deg(displaced), angles_deg.at(frame++), 1e-3) << time_s;
  });
  EXPECT_EQ(frame, angles_deg.size());
  EXPECT_GT(*std::max_element(angles_deg.begin(), angles_deg.end()), 20) << "it is pushed open";
}

TEST(ShippedScenes, ParticlesFallOnTheHandAndAreThrown) {
  Scene scene("particles");
  double highest_m = 0;
  std::size_t max_grains = 0, in_hull = 0;
  scene.play([&](double time_s) {
    const sim::ParticleSet& grains = scene.simulation().particles(0);
    max_grains = std::max(max_grains, grains.size());
    for (std::size_t i = 0; i < grains.size(); ++i) {
      // The spout is at z = 0.53 m. The hand throws at this time.
      if (time_s > 4.2 && time_s < 5 && grains.v_world_m_s[i].z() > 0.3)
        highest_m = std::max(highest_m, grains.p_world_m[i].z());
      in_hull += hull::in_hull(scene.silhouettes(), grains.p_world_m[i]);
    }
  });
  std::printf("particles: at most %zu grains, thrown to z = %.2f m, %llu contacts, %llu stuck\n",
              max_grains, highest_m,
              static_cast<unsigned long long>(scene.simulation().counters().particles.contacts),
              static_cast<unsigned long long>(scene.simulation().counters().particles.stuck));
  EXPECT_NEAR(double(max_grains), 4500, 50);
  EXPECT_GT(highest_m, 0.33);
  EXPECT_EQ(in_hull, 0u);
  EXPECT_GT(scene.simulation().counters().particles.contacts, 20000u);
  EXPECT_LT(scene.simulation().counters().particles.stuck, 10u);
}

}  // namespace
}  // namespace fivepipe::test
