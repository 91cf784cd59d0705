// Hard cases of rigid contact with the hull.
#include "tests/support/sim_contact.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

// The fastest speed of an object over some frames of held or given silhouettes.
double fastest_m_s(sim::Simulation& simulation, double from_s, int steps) {
  double fastest = 0;
  for (int step = 1; step <= steps; ++step) {
    simulation.advance_to(from_s + step * kStep_s);
    fastest = std::max(fastest, velocity_m_s(simulation).norm());
  }
  return fastest;
}

std::vector<hull::Silhouette> block_with_top_at(double z_m,
                                                const std::vector<geometry::Camera>& cameras) {
  return silhouettes_of_box(
      Eigen::AlignedBox3d(Vector3d(-0.08, -0.08, z_m - 0.1), Vector3d(0.08, 0.08, z_m)), cameras);
}

// A rod appears across a closed door, 60 cm from its hinge. The door opens by the angle that the
// rod demands within half a second, by moves without velocity: its edge is slower than 10 cm/s.
TEST(ContactHardCase, AHullAppearsInAClosedDoor) {
  const auto cameras = ring(8, 2.5, 0.02, 600, 1.4, {0.1, 0.1, 0});
  const double radius_m = 0.02, x_m = 0.6;
  const auto rod =
      silhouettes_of({{{-0.4 + x_m, 0, -0.2}, {-0.4 + x_m, 0, 0.2}, radius_m}}, cameras);
  sim::Simulation simulation(scene_of({door()}), {});
  simulation.advance_to(0, {});
  simulation.advance_to(0.1, rod);
  EXPECT_LT(fastest_m_s(simulation, 0.1, 120), 0.1);
  const double demanded_rad = std::asin((radius_m + 0.02) / x_m);
  EXPECT_NEAR(angle_rad(simulation.states()[0].world_from_object), demanded_rad, 2 * kDegree_rad);
}

// The hull appears around a whole ball. It leaves by the shortest way, in half a second.
TEST(ContactHardCase, AHullAppearsAroundABall) {
  const auto cameras = ring(5, 12, 0, 500, 1.2);
  const auto block = block_with_top_at(0.06, cameras);
  sim::Simulation simulation(scene_of({touching_ball({0.01, 0.02, 0.02}, 0.02, 0.5, 0.5)}), {});
  simulation.advance_to(0, {});
  simulation.advance_to(0.01, block);
  EXPECT_LT(fastest_m_s(simulation, 0.01, 120), 0.2);
  EXPECT_NEAR(center_m(simulation).z(), 0.06 + 0.02, 0.004);
  EXPECT_EQ(simulation.counters().unrecovered, 0u);
}

// While the simulation is paused for ten seconds, the real block is lifted by 3 cm.
TEST(ContactHardCase, AHullRisesIntoABallDuringAPauseOfTenSeconds) {
  const auto cameras = ring(5, 1.5, 0, 300, 0.6);
  const auto low = block_with_top_at(0, cameras), high = block_with_top_at(0.03, cameras);
  sim::Simulation simulation(scene_of({touching_ball({0, 0, 0.05}, 0.04, 0.5, 0.5)}), {});
  for (int frame = 0; frame <= 30; ++frame) simulation.advance_to(frame * kFrame_s, low);
  simulation.pause();
  const Vector3d before_m = center_m(simulation);
  simulation.advance_to(11, high);
  EXPECT_EQ(center_m(simulation), before_m);
  simulation.resume();
  EXPECT_LT(fastest_m_s(simulation, 11, 60), 0.2);
  EXPECT_NEAR(center_m(simulation).z(), 0.03 + 0.04, 0.003);
}

// The same with a history: the pause is no motion of the block.
TEST(ContactHardCase, APauseOfTenSecondsIsNoMotionOfAPart) {
  const auto cameras = ring(5, 12, 0, 500, 1.2);
  const auto low = block_with_top_at(0, cameras), high = block_with_top_at(0.03, cameras);
  config::Scene scene = scene_of({touching_ball({0, 0, 0.05}, 0.04, 0.5, 0.5)});
  scene.history.emplace();
  sim::Simulation simulation(scene, {}, {Vector3d(-0.3, -0.3, -0.3), Vector3d(0.3, 0.3, 0.5)});
  // The block moves until the pause.
  std::vector<hull::Silhouette> seen;
  for (int frame = 0; frame <= 30; ++frame) {
    seen = block_with_top_at(frame < 20 ? -0.05 : -0.05 + 0.005 * (frame - 20), cameras);
    simulation.advance_to(frame * kFrame_s, seen);
  }
  simulation.pause();
  simulation.advance_to(11, low);
  simulation.resume();
  EXPECT_LT(fastest_m_s(simulation, 11, 60), 0.3);
  EXPECT_NEAR(center_m(simulation).z(), 0.04, 0.004);
  simulation.advance_to(11 + 61 * kStep_s, high);
  EXPECT_TRUE(all_finite(simulation));
}

// Without one of its cameras the hull of the block is larger, but as flat.
TEST(ContactHardCase, ACameraIsLostWhileABallRestsOnTheHull) {
  const auto silhouettes = real_block();
  const std::vector<hull::Silhouette> without(silhouettes.begin(), silhouettes.end() - 1);
  sim::Simulation simulation(scene_of({touching_ball({0.01, 0.02, 0.05}, 0.04, 0.5, 0.5)}), {});
  double fastest = 0;
  for (int frame = 0; frame <= 120; ++frame) {
    simulation.advance_to(frame * kFrame_s, frame / 20 % 2 == 0 ? silhouettes : without);
    if (frame > 15) fastest = std::max(fastest, velocity_m_s(simulation).norm());
  }
  EXPECT_LT(fastest, 0.1);
  EXPECT_LT((center_m(simulation) - Vector3d(0.01, 0.02, 0.04)).norm(), 0.005)
      << center_m(simulation).transpose();
}

// All cameras are lost, and the hull with them: the ball falls.
TEST(ContactHardCase, ABallFallsWhenTheHullIsGone) {
  const auto silhouettes = real_block();
  sim::Simulation simulation(scene_of({touching_ball({0, 0, 0.05}, 0.04, 0.5, 0.5)}), {});
  for (int frame = 0; frame <= 30; ++frame) simulation.advance_to(frame * kFrame_s, silhouettes);
  for (int frame = 31; frame <= 45; ++frame) simulation.advance_to(frame * kFrame_s, {});
  const double time_s = 15 * kFrame_s;
  EXPECT_NEAR(center_m(simulation).z(), 0.04 - 0.5 * kGravity_m_s2 * time_s * time_s, 0.05);
}

// The block jumps up by 5 cm between two frames. With a history, the jump is a motion of 1.5 m/s;
// without, it gives no velocity.
TEST(ContactHardCase, AHullThatJumpsGivesNoMoreVelocityThanItsMotionExplains) {
  const auto cameras = ring(5, 12, 0, 500, 1.2);
  const auto low = block_with_top_at(0, cameras), high = block_with_top_at(0.05, cameras);
  for (const bool has_history : {false, true}) {
    config::Scene scene = scene_of({touching_ball({0, 0, 0.05}, 0.04, 0, 0.5)});
    if (has_history) scene.history.emplace();
    sim::Simulation simulation(scene, {}, {Vector3d(-0.3, -0.3, -0.3), Vector3d(0.3, 0.3, 0.5)});
    for (int frame = 0; frame <= 30; ++frame) simulation.advance_to(frame * kFrame_s, low);
    double fastest = 0;
    for (int frame = 31; frame <= 60; ++frame) {
      simulation.advance_to(frame * kFrame_s, high);
      fastest = std::max(fastest, velocity_m_s(simulation).norm());
    }
    EXPECT_LT(fastest, has_history ? 1.2 * 0.05 / kFrame_s : 0.2) << has_history;
    EXPECT_NEAR(center_m(simulation).z(), 0.05 + 0.04, 0.006) << has_history;
  }
}

// Maps at 5 Hz: the block rises by 6 cm per map.
TEST(ContactHardCase, ABallIsLiftedByMapsAtFiveHertz) {
  const auto cameras = ring(5, 12, 0, 500, 1.2, {0, 0, 0.1});
  config::Scene scene = scene_of({touching_ball({0, 0, -0.2 + 0.05}, 0.05, 0, 0.5)});
  scene.history = config::HistoryRequests{.max_speed_m_s = 2};
  sim::Simulation simulation(scene, {}, {Vector3d(-0.3, -0.3, -0.5), Vector3d(0.3, 0.3, 0.8)});
  std::vector<hull::Silhouette> seen;
  double z_m = -0.2;
  for (int frame = 0; frame <= 12; ++frame) {
    if (frame > 4) z_m += 0.06;
    seen = block_with_top_at(z_m, cameras);
    simulation.advance_to(frame * 0.2, seen);
    if (frame > 7) {
      EXPECT_NEAR(center_m(simulation).z(), z_m + 0.05, 0.01) << frame;
      EXPECT_NEAR(velocity_m_s(simulation).z(), 0.3, 0.1) << frame;
    }
  }
}

// A ball between two real bars that are nearer to each other than its diameter. It may roll along
// them, in the hollow that the hull has there, but gains no energy.
TEST(ContactHardCase, ABallBetweenTwoBarsStaysThere) {
  const auto bars =
      seen({{{-0.2, -0.05, 0}, {0.2, -0.05, 0}, 0.02}, {{-0.2, 0.05, 0}, {0.2, 0.05, 0}, 0.02}});
  sim::Simulation simulation(scene_of({touching_ball({0, 0.002, 0.1}, 0.045, 0.2, 0.3)}), {});
  double early_m_s = 0, late_m_s = 0;
  for (int frame = 0; frame <= 600; ++frame) {
    simulation.advance_to(frame * kFrame_s, bars);
    ASSERT_TRUE(all_finite(simulation));
    if (frame < 30) continue;
    double& fastest_m_s = frame < 90 ? early_m_s : late_m_s;
    fastest_m_s = std::max(fastest_m_s, velocity_m_s(simulation).norm());
    EXPECT_NEAR(center_m(simulation).z(), 0.067, 0.005);
    EXPECT_LT(std::abs(center_m(simulation).y()), 0.005);
  }
  EXPECT_LT(early_m_s, 0.1);
  EXPECT_LT(late_m_s, 1e-3) << "it has come to rest";
}

// Two tracked hands carry a box up, and one moves away. The contacts with the other stay, whatever
// the order of the parts.
TEST(ContactHardCase, ABoxHeldByTwoHandsKeepsTheContactsOfTheOther) {
  const auto cameras = ring(7, 2, 0.15, 500, 0.8, {0, 0, 0.1});
  for (const double side : {-1.0, 1.0}) {
    config::SceneObject box = touching(virtual_box("box", {0, 0, 0.1}, {0.1, 0.1, 0.1}));
    box.friction = 1;
    config::Scene scene = scene_of({box});
    scene.history.emplace();
    sim::Simulation simulation(scene, {},
                               {Vector3d(-0.35, -0.35, -0.2), Vector3d(0.35, 0.35, 0.5)});
    std::vector<hull::Silhouette> seen;
    for (int frame = 0; frame <= 60; ++frame) {
      // From frame 40 on, the hand on this side moves away.
      const double away_m = frame < 40 ? 0 : 0.01 * (frame - 40),
                   z_m = 0.04 + 0.002 * std::max(0, std::min(frame, 40) - 15);
      const auto hand = [&](double x_m) {
        return hull::Capsule{{x_m, -0.04, z_m}, {x_m, 0.04, z_m}, 0.02};
      };
      // They support it from below, at its left and right.
      seen = silhouettes_of({hand(side * (0.035 + away_m)), hand(-side * 0.035)}, cameras);
      simulation.advance_to(frame * kFrame_s, seen);
      ASSERT_TRUE(all_finite(simulation));
      if (frame == 39) {
        EXPECT_NEAR(center_m(simulation).z(), z_m + 0.02 + 0.05, 0.02) << "it is carried";
      }
    }
    EXPECT_LT(center_m(simulation).z(), 0.15) << "it tips off the other";
  }
}

// Bodies of every kind, at rest and thrown.
std::vector<config::SceneObject> several_bodies() {
  config::SceneObject box = touching(virtual_box("box", {-0.03, 0.01, 0.05}, {0.04, 0.04, 0.04}));
  config::SceneObject falling =
      touching(virtual_box("falling", {0.03, 0.03, 0.2}, {0.05, 0.02, 0.03}));
  falling.velocity_world_m_s = {-0.3, 0, 0};
  return {box, falling, touching_ball({0.05, -0.03, 0.12}, 0.02, 0.6, 0.3)};
}

TEST(ContactDeterminism, ResultsAreTheSameBitsWithAnyNumberOfThreads) {
  const auto silhouettes = real_block();
  const config::Scene scene = scene_of(several_bodies());
  sim::Simulation one(scene, {.threads = 1}), three(scene, {.threads = 3});
  for (int frame = 0; frame < 60; ++frame) {
    one.advance_to(frame * kFrame_s, silhouettes);
    three.advance_to(frame * kFrame_s, silhouettes);
    for (std::size_t i = 0; i < 3; ++i)
      ASSERT_EQ(one.states()[i].world_from_object.matrix(),
                three.states()[i].world_from_object.matrix())
          << frame;
  }
}

TEST(ContactDeterminism, AResetRepeatsTheSameBits) {
  const auto silhouettes = real_block();
  sim::Simulation simulation(scene_of(several_bodies()), {});
  std::vector<Eigen::Matrix4d> first;
  for (int frame = 0; frame < 60; ++frame) {
    simulation.advance_to(frame * kFrame_s, silhouettes);
    first.push_back(simulation.states()[1].world_from_object.matrix());
  }
  simulation.reset();
  // The clock goes on: the same steps follow.
  for (int frame = 60; frame < 119; ++frame) simulation.advance_to(frame * kFrame_s, silhouettes);
  EXPECT_EQ(simulation.states()[1].world_from_object.matrix(), first[59]);
}

// The resting state hardly depends on the step's length.
TEST(ContactRest, IsTheSameAtEveryStepLength) {
  const auto silhouettes = real_block();
  std::vector<std::vector<Vector3d>> places;
  for (const double step_s : {1.0 / 240, 1.0 / 120, 1.0 / 60}) {
    config::Scene scene =
        scene_of({touching_ball({0.04, 0.02, 0.045}, 0.04, 0.2, 0.5),
                  touching(virtual_box("box", {-0.04, 0, 0.035}, {0.06, 0.06, 0.06}))});
    sim::Simulation simulation(scene, {.step_s = step_s});
    for (int frame = 0; frame <= 60; ++frame) simulation.advance_to(frame * kFrame_s, silhouettes);
    places.push_back({center_m(simulation, 0), center_m(simulation, 1)});
    EXPECT_LT(velocity_m_s(simulation, 0).norm(), 1e-3) << step_s;
    EXPECT_LT(velocity_m_s(simulation, 1).norm(), 1e-3) << step_s;
  }
  for (std::size_t i = 0; i < 2; ++i)
    for (std::size_t k = 1; k < 3; ++k)
      EXPECT_LT((places[k][i] - places[0][i]).norm(), 2e-3) << i << ' ' << k << ": a pixel";
}

}  // namespace
}  // namespace fivepipe::test
