// Time in a whole simulation, contacts among virtual objects, and objects that leave the scene.
#include <limits>
#include <stdexcept>

#include "tests/support/not_finite.h"
#include "tests/support/sim_scene.h"

namespace fivepipe::test {
namespace {

class SimulationTime : public GlTest {};

config::Scene ball_over_floor() {
  return scene_of({virtual_ball({0, 0, 0.5}), virtual_box("floor", {0, 0, -0.05}, {2, 2, 0.1})});
}

Eigen::Vector3d ball_position_m(const sim::Simulation& simulation) {
  return simulation.states()[0].world_from_object.translation();
}

void run_frames(sim::Simulation& simulation, int first, int last,
                std::span<const hull::Silhouette> silhouettes, double frame_s = kFrame_s) {
  for (int frame = first; frame <= last; ++frame)
    simulation.advance_to(frame * frame_s, silhouettes);
}

TEST_F(SimulationTime, FirstCallOnlySetsTheClock) {
  sim::Simulation simulation(ball_over_floor(), {});
  simulation.advance_to(1e6, {});
  EXPECT_EQ(simulation.counters().steps, 0u);
  EXPECT_EQ(simulation.time_s(), 1e6);
  simulation.advance_to(1e6 + 0.1, {});
  EXPECT_EQ(simulation.counters().steps, 24u);
  EXPECT_NEAR(simulation.time_s(), 1e6 + 0.1, 1e-6);
}

TEST_F(SimulationTime, FreeFallMatchesTheClosedForm) {
  sim::Simulation simulation(scene_of({virtual_ball({0, 0, 1})}), {});
  run_frames(simulation, 0, 12, {});
  const double t_s = 0.4, g = 9.80665, step_s = 1.0 / 240;
  // Semi-implicit Euler falls by exactly g t (t + step) / 2, which is g t step / 2 below the
  // parabola.
  EXPECT_NEAR(ball_position_m(simulation).z(), 1 - 0.5 * g * t_s * (t_s + step_s), 1e-6);
  EXPECT_NEAR(simulation.states()[0].velocity_world_m_s.z(), -g * t_s, 1e-6);
}

TEST_F(SimulationTime, RestPositionIsIndependentOfStepSize) {
  for (const double step_s : {1.0 / 240, 1.0 / 120, 1.0 / 60, 1.0 / 30}) {
    sim::Simulation simulation(ball_over_floor(), {.step_s = step_s});
    run_frames(simulation, 0, 300, {});
    const Eigen::Vector3d p_m = ball_position_m(simulation);
    // A body at rest sinks for one step before the contact stops it, by g step^2: 11 mm at 1/30 s.
    // Bullet pushes it out over several steps.
    EXPECT_NEAR(p_m.z(), kBallRadius_m, 1e-3 + 9.81 * step_s * step_s) << step_s;
    EXPECT_NEAR(p_m.head<2>().norm(), 0, 1e-3) << step_s;
    EXPECT_LT(simulation.states()[0].velocity_world_m_s.norm(), 0.02) << step_s;
  }
}

TEST_F(SimulationTime, DoesNotDriftAtRestForFiveMinutes) {
  sim::Simulation simulation(ball_over_floor(), {.step_s = 1.0 / 60});
  run_frames(simulation, 0, 150, {}, 0.1);
  const Eigen::Vector3d before_m = ball_position_m(simulation);
  run_frames(simulation, 151, 3150, {}, 0.1);
  EXPECT_LT((ball_position_m(simulation) - before_m).norm(), 1e-3);
}

TEST_F(SimulationTime, SkippedTimeIsCounted) {
  sim::Simulation simulation(ball_over_floor(), {});
  simulation.advance_to(0, {});
  simulation.advance_to(5, {});
  EXPECT_EQ(simulation.counters().steps, 60u);  // a quarter of a second
  EXPECT_NEAR(simulation.counters().skipped_s, 4.75, 1e-9);
  EXPECT_NEAR(simulation.time_s(), 5, 1e-9);
}

// sim_node ends in time although it has many slow steps to catch up.
TEST_F(SimulationTime, StopsBetweenSteps) {
  int calls = 0;
  sim::Simulation simulation(ball_over_floor(), {}, {}, [&] { return ++calls > 3; });
  EXPECT_TRUE(simulation.advance_to(0, {}));
  EXPECT_FALSE(simulation.advance_to(5, {}));
  EXPECT_EQ(simulation.counters().steps, 3u);
}

TEST_F(SimulationTime, PauseIsNotReplayed) {
  sim::Simulation simulation(ball_over_floor(), {});
  run_frames(simulation, 0, 5, {});
  const Eigen::Vector3d before_m = ball_position_m(simulation);
  simulation.pause();
  run_frames(simulation, 6, 305, {});  // ten seconds
  EXPECT_EQ(ball_position_m(simulation), before_m);
  simulation.resume();
  const std::uint64_t steps = simulation.counters().steps;
  simulation.advance_to(306 * kFrame_s, {});
  EXPECT_EQ(simulation.counters().steps - steps, 8u);
  EXPECT_EQ(simulation.counters().skipped_s, 0);
  EXPECT_NEAR(simulation.time_s(), 306 * kFrame_s, 1e-9);
}

TEST_F(SimulationTime, SmallBackwardStampIsIgnoredLargeOneResetsTheClock) {
  sim::Simulation simulation(ball_over_floor(), {});
  run_frames(simulation, 0, 30, {});
  const Eigen::Vector3d before_m = ball_position_m(simulation);
  simulation.advance_to(29 * kFrame_s, {});
  EXPECT_NEAR(simulation.time_s(), 1, 1e-9);
  simulation.advance_to(0, {});
  EXPECT_EQ(simulation.time_s(), 0);
  EXPECT_EQ(ball_position_m(simulation), before_m);
  EXPECT_EQ(simulation.counters().backward_stamps, 2u);
  simulation.advance_to(kFrame_s, {});
  EXPECT_NEAR(simulation.time_s(), kFrame_s, 1e-9);
}

TEST_F(SimulationTime, ResetMovesEverythingToItsStart) {
  sim::Simulation simulation(ball_over_floor(), {}), fresh(ball_over_floor(), {});
  run_frames(simulation, 0, 20, {});
  simulation.reset();
  EXPECT_EQ(ball_position_m(simulation), Eigen::Vector3d(0, 0, 0.5));
  run_frames(simulation, 20, 60, {});
  run_frames(fresh, 20, 60, {});
  EXPECT_EQ(ball_position_m(simulation), ball_position_m(fresh));
}

TEST_F(SimulationTime, LostObjectsAreRespawnedAndCounted) {
  sim::Simulation simulation(scene_of({virtual_ball({0, 0, 0.2})}), {});
  run_frames(simulation, 0, 60, {});  // two seconds: 19 m
  EXPECT_GE(simulation.counters().respawned, 1u);
  EXPECT_GT(ball_position_m(simulation).z(), 0.2 - 3 - 0.5);
}

TEST_F(SimulationTime, ObjectsAreLostThreeMetresOutsideTheStart) {
  for (const double down : {1.0, -1.0}) {
    config::Scene scene = scene_of({virtual_ball({0, 0, 0.2})});
    scene.gravity_m_s2 *= down;
    sim::Simulation simulation(scene, {});
    double farthest_m = 0;
    for (int step = 0; simulation.counters().respawned == 0 && step < 240; ++step) {
      simulation.advance_to(step / 240.0, {});
      farthest_m = std::max(farthest_m, down * (0.2 - ball_position_m(simulation).z()));
    }
    // From its centre to the ball's edge and 3 m farther, less up to a step of 3.2 cm.
    EXPECT_LE(farthest_m, kBallRadius_m + 3);
    EXPECT_GT(farthest_m, kBallRadius_m + 3 - 0.033);
    EXPECT_EQ(simulation.counters().respawned, 1u);
    EXPECT_EQ(ball_position_m(simulation), Eigen::Vector3d(0, 0, 0.2));
  }
}

TEST_F(SimulationTime, StackAndOffCenterMeshStand) {
  std::vector<config::SceneObject> objects = {virtual_box("floor", {0, 0, -0.05}, {2, 2, 0.1})};
  for (int i = 0; i < 4; ++i) {
    objects.push_back(
        virtual_box("box" + std::to_string(i), {0, 0, 0.05 + 0.1 * i}, {0.1, 0.1, 0.1}));
    objects.back().motion = config::Motion::dynamic;
  }
  // A mesh with its origin far from its centre.
  config::MeshShape wedge{.file = "", .unit_m = 1, .mesh = geometry::box_mesh({0.1, 0.1, 0.1})};
  for (Eigen::Vector3d& v : wedge.mesh.vertices_m) v += Eigen::Vector3d(1, 0, 0);
  objects.push_back({.name = "wedge",
                     .shape = wedge,
                     .world_from_object = at({-0.5, 0, 0.2}),
                     .motion = config::Motion::dynamic});
  sim::Simulation simulation(scene_of(objects), {});
  run_frames(simulation, 0, 90, {});
  const auto states = simulation.states();
  for (int i = 0; i < 4; ++i)
    EXPECT_NEAR(states[std::size_t(i) + 1].world_from_object.translation().z(), 0.05 + 0.1 * i,
                0.01);
  // It may tumble but ends on a face: its centre is at half its height plus Bullet's margin of 1
  // mm.
  EXPECT_NEAR((states[5].world_from_object * Eigen::Vector3d(1, 0, 0)).z(), 0.051, 0.002);
  EXPECT_LT(
      (states[5].world_from_object * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(0.5, 0, 0)).norm(),
      0.2);
}

// The ball moves by twice its size per step of 1/240 s: without the sweep it would be above the
// plate in one step and below it in the next.
TEST_F(SimulationTime, FallingBallDoesNotTunnelThroughAThinPlate) {
  for (const double start_m : {20.0, 20.02, 20.04, 20.06}) {  // within one step, 8 cm
    config::SceneObject small_ball = virtual_ball({0, 0, start_m}, 0);
    small_ball.shape = config::SphereShape{0.02};
    sim::Simulation simulation(
        scene_of({small_ball, virtual_box("plate", {0, 0, 0}, {2, 2, 0.005})}), {});
    double lowest_m = start_m;
    for (int step = 0; step <= 3 * 240; ++step) {
      simulation.advance_to(step / 240.0, {});
      lowest_m = std::min(lowest_m, ball_position_m(simulation).z());
    }
    EXPECT_LT(lowest_m, 0.04) << start_m;  // it has fallen, at 19.8 m/s
    EXPECT_GT(lowest_m, 0) << start_m;
    EXPECT_EQ(simulation.counters().respawned, 0u) << start_m;
  }
}

TEST_F(SimulationTime, RejectsInvalidTimes) {
  sim::Simulation simulation(ball_over_floor(), {});
  EXPECT_THROW(simulation.advance_to(std::numeric_limits<double>::quiet_NaN(), {}),
               std::invalid_argument);
  EXPECT_THROW(simulation.advance_to(std::numeric_limits<double>::quiet_NaN()),
               std::invalid_argument);
}

TEST_F(SimulationTime, RejectsOnlyInvalidConfigurations) {
  const auto is_valid = [](const config::SimConfig& config) {
    try {
      sim::Simulation simulation(ball_over_floor(), config);
      return true;
    } catch (const std::invalid_argument&) {
      return false;
    }
  };
  EXPECT_TRUE(is_valid({.step_s = 1e-3}));
  for (const double step_s : {0.0, -1e-3, kInfinity, kNaN})
    EXPECT_FALSE(is_valid({.step_s = step_s})) << step_s;
  EXPECT_TRUE(is_valid({.eps_m = collision::kMinEps_m}));
  for (const double eps_m : {0.5 * collision::kMinEps_m, kInfinity, kNaN})
    EXPECT_FALSE(is_valid({.eps_m = eps_m})) << eps_m;
  EXPECT_TRUE(is_valid({.spacing_m = 1e-3}));
  for (const double spacing_m : {0.0, -1e-3, kInfinity, kNaN})
    EXPECT_FALSE(is_valid({.spacing_m = spacing_m})) << spacing_m;
  EXPECT_TRUE(is_valid({.max_points = 0}));
  EXPECT_FALSE(is_valid({.max_points = -1}));
  EXPECT_TRUE(is_valid({.threads = 1}));
  EXPECT_FALSE(is_valid({.threads = 0}));
}

}  // namespace
}  // namespace fivepipe::test
