// Contact of a cloth with the scene's rigid objects.
#include "sim_node/cloth/cloth_object_contact.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "sim_node/simulation/simulation.h"
#include "tests/support/sim_scene.h"

namespace fivepipe::sim {
namespace {

using Eigen::Vector3d;

constexpr double kGap_m = 0.003;

// A horizontal sheet of 0.2 m by 0.2 m around the place.
config::SceneObject sheet(const Vector3d& center_m) {
  config::SceneObject object{
      .name = "sheet",
      .shape = config::CurtainShape{0.2, 0.2, 8, 8, 0, 0},
      .world_from_object = test::at(center_m + Vector3d(0, 0.1, 0)) *
                           Eigen::AngleAxisd(-0.5 * std::numbers::pi, Vector3d::UnitX()),
      .motion = config::Motion::cloth,
      .reaction = config::Reaction::yield,
      .cloth = config::ClothSettings{}};
  object.cloth->thickness_m = kGap_m;
  object.cloth->air_drag_1_s = 0;
  object.cloth->object_collision = true;
  return object;
}

config::SceneObject board(double z_m, double thickness_m) {
  return test::virtual_box("board", {0, 0, z_m - 0.5 * thickness_m}, {2, 2, thickness_m});
}

std::vector<Vector3d> vertices_world_m(const Simulation& simulation, std::size_t object) {
  const ObjectState state = simulation.states()[object];
  std::vector<Vector3d> vertices_m;
  for (const Vector3d& p : state.vertices_m) vertices_m.push_back(state.world_from_object * p);
  return vertices_m;
}

template <class Distance>
double least(const std::vector<Vector3d>& points_m, const Distance& distance_m) {
  double least_m = std::numeric_limits<double>::infinity();
  for (const Vector3d& p : points_m) least_m = std::min(least_m, distance_m(p));
  return least_m;
}

double lowest_m(const Simulation& simulation) {
  return least(vertices_world_m(simulation, 0), [](const Vector3d& p) { return p.z(); });
}

void run(Simulation& simulation, double seconds) {
  for (int frame = 0; frame <= int(std::round(seconds / test::kFrame_s)); ++frame)
    simulation.advance_to(frame * test::kFrame_s);
}

TEST(ClothObjectContact, AFallingSheetComesToRestOnATable) {
  Simulation simulation(test::scene_of({sheet({0, 0, 0.1}), board(0, 0.02)}), {});
  run(simulation, 2);
  EXPECT_NEAR(lowest_m(simulation), kGap_m, 1e-4);
  double highest_m = 0;
  for (const Vector3d& p : vertices_world_m(simulation, 0)) highest_m = std::max(highest_m, p.z());
  EXPECT_LT(highest_m, 2 * kGap_m);
  EXPECT_GT(simulation.counters().cloth.object_contacts, 0u);
}

TEST(ClothObjectContact, OnlyOnRequest) {
  config::SceneObject free = sheet({0, 0, 0.1});
  free.cloth->object_collision = false;
  Simulation simulation(test::scene_of({free, board(0, 0.02)}), {});
  run(simulation, 0.5);
  EXPECT_LT(lowest_m(simulation), -0.5);
  EXPECT_EQ(simulation.counters().cloth.object_contacts, 0u);
}

// It falls at 2.4 m/s, the largest speed of a cloth of this size, so that a step of 1/60 s moves it
// 39 mm, four times the board's thickness.
TEST(ClothObjectContact, AFastSheetDoesNotPassThroughAThinBoard) {
  Simulation simulation(test::scene_of({sheet({0, 0, 1}), board(-1, 0.01)}), {.step_s = 1.0 / 60});
  double least_m = 9;
  for (int frame = 0; frame <= 60; ++frame) {
    simulation.advance_to(frame * test::kFrame_s);
    least_m = std::min(least_m, lowest_m(simulation));
  }
  EXPECT_GT(simulation.counters().cloth.object_contacts, 0u);
  EXPECT_GT(least_m, -1 + kGap_m - 1e-9);
}

// Coulomb: it stays below the friction angle and slides at g (sin - mu cos) above.
TEST(ClothObjectContact, FrictionHoldsItOnASlopeBelowTheFrictionAngle) {
  for (const double slope_deg : {15.0, 30.0}) {
    constexpr double kFriction = 0.4;  // 21.8 degrees
    const double slope_rad = slope_deg * std::numbers::pi / 180;
    const Eigen::Isometry3d world_from_slope(Eigen::AngleAxisd(slope_rad, Vector3d::UnitY()));
    config::SceneObject cloth = sheet({0, 0, kGap_m}), slope = board(0, 0.02);
    cloth.cloth->friction = kFriction;
    for (config::SceneObject* object : {&cloth, &slope})
      object->world_from_object = world_from_slope * object->world_from_object;
    Simulation simulation(test::scene_of({cloth, slope}), {});
    const auto place_m = [&] {
      Vector3d sum = Vector3d::Zero();
      const std::vector<Vector3d> vertices_m = vertices_world_m(simulation, 0);
      for (const Vector3d& p : vertices_m) sum += p;
      return world_from_slope.linear().col(0).dot(sum) / double(vertices_m.size());
    };
    constexpr double kSlide_s = 0.5;
    run(simulation, kSlide_s);
    const double expected_m = 0.5 * test::kGravity_m_s2 * kSlide_s * kSlide_s *
                              std::max(0.0, std::sin(slope_rad) - kFriction * std::cos(slope_rad));
    EXPECT_NEAR(place_m(), expected_m, 0.0005 + 0.02 * expected_m) << slope_deg;
  }
}

// A ball flies into a hanging cloth and takes it along.
TEST(ClothObjectContact, ABallThatMovesPushesTheCloth) {
  config::SceneObject curtain{.name = "curtain",
                              .shape = config::CurtainShape{0.4, 0.4, 16, 16, 0, 0},
                              .world_from_object = test::at({0, 0, 0.2}),
                              .motion = config::Motion::cloth,
                              .reaction = config::Reaction::yield,
                              .cloth = config::ClothSettings{}};
  curtain.cloth->thickness_m = kGap_m;
  curtain.cloth->object_collision = true;
  curtain.cloth->pins = {{{Vector3d(-1, -1, -1e-6), Vector3d(1, 1, 1e-6)}}};
  config::SceneObject ball = test::virtual_ball({0, -0.3, -0.1});
  ball.reaction = config::Reaction::none;
  ball.velocity_world_m_s = {0, 1.5, 1.2};
  Simulation simulation(test::scene_of({curtain, ball}), {});
  double least_m = 9, farthest_m = 0;
  for (int frame = 1; frame <= 12; ++frame) {
    simulation.advance_to(frame * test::kFrame_s);
    const Vector3d center_m = simulation.states()[1].world_from_object.translation();
    for (const Vector3d& p : vertices_world_m(simulation, 0)) {
      least_m = std::min(least_m, (p - center_m).norm());
      farthest_m = std::max(farthest_m, p.y());
    }
  }
  EXPECT_GT(least_m, test::kBallRadius_m + kGap_m - 1e-3);
  EXPECT_GT(farthest_m, 0.1);
}

// The hull pushes the cloth deeper into a wall than half of the wall. It comes back on its side.
TEST(ClothObjectContact, AClothCrushedBetweenTheHullAndAWallStaysOnItsSide) {
  config::SceneObject curtain{.name = "curtain",
                              .shape = config::CurtainShape{0.3, 0.4, 12, 16, 0, 0},
                              .world_from_object = test::at({0, 0, 0.2}),
                              .motion = config::Motion::cloth,
                              .reaction = config::Reaction::yield,
                              .cloth = config::ClothSettings{}};
  curtain.cloth->object_collision = true;
  curtain.cloth->v_rec_world = Vector3d(0, 1, 0);
  curtain.cloth->pins = {{{Vector3d(-1, -1, -1e-6), Vector3d(1, 1, 1e-6)}}};
  constexpr double kFront_m = 0.02, kWall_m = 0.08;
  const config::SceneObject wall =
      test::virtual_box("wall", {0, kFront_m + 0.5 * kWall_m, 0}, {1, kWall_m, 1});
  Simulation simulation(test::scene_of({curtain, wall}), {});
  double deepest_m = 0, time_s = 0;
  for (int frame = 1; frame <= 30; ++frame) {
    time_s = frame * test::kFrame_s;
    // The ball's front goes from y = -0.07 to 0.09 m. Then the ball vanishes.
    const double y_m = -0.07 + 0.16 * std::sin(std::numbers::pi * frame / 60) - 0.05;
    simulation.advance_to(time_s, test::seen({test::ball({0, y_m, 0}, 0.05)}));
    for (const Vector3d& p : vertices_world_m(simulation, 0)) {
      ASSERT_TRUE(p.allFinite());
      deepest_m = std::max(deepest_m, p.y() - kFront_m);
    }
  }
  EXPECT_GT(deepest_m, 0.5 * kWall_m);
  // 100 ms later all of it is before the wall.
  for (int frame = 1; frame <= 3; ++frame)
    simulation.advance_to(time_s + frame * test::kFrame_s, test::seen({}));
  const double thickness_m = config::ClothSettings{}.thickness_m;
  for (const Vector3d& p : vertices_world_m(simulation, 0))
    EXPECT_LE(p.y(), kFront_m - thickness_m + 1e-9);
}

// It passes beside the box, then below it. The line from its start to its end crosses the box.
TEST(ClothObjectContact, AClothThatGoesAroundAnObjectIsFree) {
  const config::Scene scene =
      test::scene_of({test::virtual_box("box", {0, 0, 0}, {0.4, 0.4, 0.1})});
  const ObjectModels models = object_models(scene);
  const RigidBodies bodies(scene);
  MovingObjects objects(scene, models, bodies);
  const config::SceneObject small = sheet({0.4, 0, 0.2});
  Cloth cloth(config::mesh_of(small), small.world_from_object, *small.cloth);
  ClothObjectContact contact(cloth, objects, kGap_m);
  const double step_s = test::kStep_s;
  // Accelerations that move it by 0.4 m in a step from rest, within 0.625 to 1 of a t^2.
  for (const Vector3d& acceleration_m_s2 :
       {Vector3d(0, 0, -0.64 / (step_s * step_s)), Vector3d(-0.64 / (step_s * step_s), 0, 0)}) {
    objects.begin_step();
    cloth.step(step_s, acceleration_m_s2, {}, 1, 1e9);
    EXPECT_EQ(contact.separate(cloth, step_s), 0u);
  }
  EXPECT_LT(cloth.vertices_world_m()[0].z(), -0.1);
}

// It slides off a slope and falls. The line back to its start crosses the slope from below.
TEST(ClothObjectContact, AfterAResetNothingIsStoppedOnTheWayBack) {
  const Eigen::Isometry3d world_from_slope(
      Eigen::AngleAxisd(0.25 * std::numbers::pi, Vector3d::UnitY()));
  config::SceneObject cloth = sheet({0, 0, 0.0031}),
                      slope = test::virtual_box("slope", {0, 0, -0.01}, {0.6, 2, 0.02});
  cloth.cloth->friction = 0;
  for (config::SceneObject* object : {&cloth, &slope})
    object->world_from_object = world_from_slope * object->world_from_object;
  Simulation simulation(test::scene_of({cloth, slope}), {});
  const std::vector<Vector3d> start_m = vertices_world_m(simulation, 0);
  run(simulation, 0.8);
  EXPECT_LT(lowest_m(simulation), -0.8);
  simulation.reset();
  EXPECT_EQ(vertices_world_m(simulation, 0), start_m);
  simulation.advance_to(0.8 + test::kFrame_s);
  const std::vector<Vector3d> moved_m = vertices_world_m(simulation, 0);
  for (std::size_t v = 0; v < start_m.size(); ++v)
    EXPECT_LT((moved_m[v] - start_m[v]).norm(),
              test::kGravity_m_s2 * test::kFrame_s * test::kFrame_s);
}

}  // namespace
}  // namespace fivepipe::sim
