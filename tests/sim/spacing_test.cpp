// Parts that an experimenter moves: their poses, what they meet, and their messages.
#include <stdexcept>

#include "sim_node/messages.h"
#include "sim_node/messages_spacing.h"
#include "tests/support/not_finite.h"
#include "tests/support/sim_scene.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

config::SceneObject movable(config::SceneObject object, const config::Spacing& spacing) {
  object.spacing = spacing;
  return object;
}

// A shelf with its top at z = 0 and x from -0.2 to 0.2 m at its spacing of 10 cm.
config::SceneObject shelf() {
  return movable(virtual_box("shelf", {0, 0, -0.05}, {0.4, 0.4, 0.1}),
                 {.axis_world = Vector3d::UnitX(), .at_m = 0.1, .low_m = -1, .high_m = 6});
}

void run_frames(sim::Simulation& simulation, int first, int last) {
  for (int frame = first; frame <= last; ++frame) simulation.advance_to(frame * kFrame_s, {});
}

class SimulatedSpacing : public GlTest {};

TEST_F(SimulatedSpacing, MovesTheObjectFromTheScenesPoseAlongTheAxis) {
  config::SceneObject part =
      movable(virtual_box("part", {1, 2, 3}, {0.1, 0.2, 0.3}),
              {.axis_world = Vector3d(0, 0.6, 0.8), .at_m = 0.1, .low_m = 0, .high_m = 0.4});
  part.world_from_object.linear() = Eigen::AngleAxisd(0.7, Vector3d::UnitZ()).matrix();
  sim::Simulation simulation(scene_of({virtual_box("other", {5, 5, 5}, {1, 1, 1}), part}), {});
  simulation.set_spacing(1, 0.35);
  for (const double spacing_m : {0.0, 0.123456789, 0.4, 0.1}) {
    simulation.set_spacing(1, spacing_m);
    const Eigen::Isometry3d pose = simulation.states()[1].world_from_object;
    const Vector3d expected_m = Vector3d(1, 2, 3) + (spacing_m - 0.1) * Vector3d(0, 0.6, 0.8);
    EXPECT_NEAR((pose.translation() - expected_m).norm(), 0, 1e-15) << spacing_m;
    EXPECT_TRUE(pose.linear().isApprox(part.world_from_object.linear(), 1e-15));
  }
  EXPECT_EQ(simulation.states()[1].world_from_object.matrix(), part.world_from_object.matrix())
      << "no error adds up";
  EXPECT_EQ(simulation.states()[0].world_from_object.translation(), Vector3d(5, 5, 5));
}

TEST_F(SimulatedSpacing, RefusesOtherObjectsAndSpacings) {
  sim::Simulation simulation(scene_of({shelf(), virtual_box("other", {5, 5, 5}, {1, 1, 1})}), {});
  EXPECT_THROW(simulation.set_spacing(1, 0.1), std::invalid_argument);
  EXPECT_THROW(simulation.set_spacing(2, 0.1), std::invalid_argument);
  for (const double bad : {-1.001, 6.001})
    EXPECT_THROW(simulation.set_spacing(0, bad), std::invalid_argument);
  for (const double bad : {kNaN, kInfinity, -kInfinity})
    EXPECT_THROW(simulation.set_spacing(0, bad), std::invalid_argument);
}

// The hull is a ball of 8 cm at the origin; the box begins to touch it at x = 13 cm.
TEST_F(SimulatedSpacing, DecidesTheCollisionWithTheHull) {
  const auto silhouettes = seen({{{0, 0, 0}, {0, 0, 0.001}, 0.08}});
  const config::SceneObject part =
      movable(virtual_box("part", {0.3, 0, 0}, {0.1, 0.1, 0.1}, config::Reaction::highlight),
              {.axis_world = -Vector3d::UnitX(), .at_m = 0, .low_m = -0.1, .high_m = 0.3});
  sim::Simulation simulation(scene_of({part}), {});
  double time_s = 0;
  for (const auto& [spacing_m, collides] :
       {std::pair{0.0, false}, {0.2, true}, {0.05, false}, {0.19, true}, {-0.1, false}}) {
    simulation.set_spacing(0, spacing_m);
    simulation.advance_to(time_s += kFrame_s, silhouettes);
    ASSERT_EQ(simulation.collisions().size(), 1u);
    EXPECT_EQ(simulation.collisions()[0].collision.colliding(), collides) << spacing_m;
  }
}

TEST_F(SimulatedSpacing, WhatRestsOnTheObjectFallsWhenItMovesAway) {
  sim::Simulation simulation(scene_of({shelf(), virtual_ball({0, 0, kBallRadius_m})}), {});
  run_frames(simulation, 0, 30);
  EXPECT_NEAR(simulation.states()[1].world_from_object.translation().z(), kBallRadius_m, 2e-3);
  simulation.set_spacing(0, 0.6);
  run_frames(simulation, 31, 45);
  // 14 frames: about 1 m.
  EXPECT_LT(simulation.states()[1].world_from_object.translation().z(), -0.5);
}

// The ball starts where only the moved shelf is, more than kLost_m from the scene's poses.
TEST_F(SimulatedSpacing, CatchesABallAtItsNewPlace) {
  config::SceneObject ball = virtual_ball({0, 0, 1});
  ball.velocity_world_m_s = {10, 0, 0};  // at x = 4.5 m after 0.45 s, when it has fallen 0.94 m
  sim::Simulation simulation(scene_of({shelf(), ball}), {});
  simulation.set_spacing(0, 4.8);
  double lowest_m = 1;
  bool bounced = false;
  for (int frame = 0; frame <= 18; ++frame) {
    simulation.advance_to(frame * kFrame_s, {});
    lowest_m = std::min(lowest_m, simulation.states()[1].world_from_object.translation().z());
    bounced |= simulation.states()[1].velocity_world_m_s.z() > 0.5;
  }
  EXPECT_TRUE(bounced);
  EXPECT_GT(lowest_m, 0);
  EXPECT_EQ(simulation.counters().respawned, 0u);
}

TEST_F(SimulatedSpacing, APartInMotionPushesParticles) {
  config::Scene scene =
      scene_of({movable(virtual_box("paddle", {-0.3, 0, 0.5}, {0.1, 2, 2}),
                        {.axis_world = Vector3d::UnitX(), .at_m = 0, .low_m = 0, .high_m = 1})});
  scene.gravity_m_s2 = 0;
  config::ParticleSource source;
  source.name = "grains";
  source.from_world_m = {Vector3d(0, -0.2, 0.3), Vector3d(0, 0.2, 0.7)};
  source.rate_hz = 300;
  source.lifetime_s = 10;
  scene.particles = {source};
  sim::Simulation simulation(scene, {});
  run_frames(simulation, 0, 10);
  ASSERT_GT(simulation.particles(0).size(), 50u);
  for (int step = 1; step <= 16; ++step) {
    simulation.set_spacing(0, 0.02 * step);
    run_frames(simulation, 10 + step, 10 + step);
  }
  // The paddle's face is at x = 7 cm; the grains were born at 0, most before it was there.
  const sim::ParticleSet& grains = simulation.particles(0);
  for (std::size_t i = 0; i < grains.size(); ++i)
    if (grains.age_s[i] > 6 * kFrame_s) {
      EXPECT_GT(grains.p_world_m[i].x(), 0.069);
    }
}

TEST_F(SimulatedSpacing, OutlivesAReset) {
  sim::Simulation simulation(scene_of({shelf(), virtual_ball({0, 0, 0.5})}), {});
  run_frames(simulation, 0, 5);
  simulation.set_spacing(0, 0.3);
  simulation.reset();
  EXPECT_NEAR(simulation.states()[0].world_from_object.translation().x(), 0.2, 1e-12);
  EXPECT_EQ(simulation.states()[1].world_from_object.translation(), Vector3d(0, 0, 0.5));
}

TEST(SpacingMessage, IsCheckedAgainstTheScene) {
  const config::Scene scene = scene_of({virtual_box("fixed", {5, 5, 5}, {1, 1, 1}), shelf()});
  const auto change_of = [&](const std::string& object, double spacing_m) {
    fivepipe_v1_SpacingRequest request{};
    messages::set_text(request.object, object);
    request.spacing_m = spacing_m;
    return sim::change_from(request, scene);
  };
  const auto good = change_of("shelf", 0.25);
  ASSERT_EQ(good.index(), 0u);
  EXPECT_EQ(std::get<0>(good).object, 1u);
  EXPECT_EQ(std::get<0>(good).spacing_m, 0.25);
  EXPECT_EQ(std::get<0>(good).capture_stamp_ns, 0);
  const auto text = [](const auto& received) {
    const auto* bad = std::get_if<messages::BadMessage>(&received);
    return bad ? messages::text_of(*bad) : "";
  };
  EXPECT_EQ(text(change_of("fixed", 0.25)), "bad_spacing: fixed: has no spacing");
  EXPECT_EQ(text(change_of("nothing", 0.25)), "bad_spacing: nothing: not in the scene");
  EXPECT_EQ(text(change_of("", 0.25)), "bad_spacing: not in the scene");
  EXPECT_EQ(text(change_of("shelf", 7)), "bad_spacing: shelf: 7 m is outside of range_m [-1, 6]");
  for (const double bad : {kNaN, kInfinity, -kInfinity})
    EXPECT_EQ(text(change_of("shelf", bad)), "bad_spacing: shelf: is not finite");

  const fivepipe_v1_ObjectSpacing spacing = sim::spacing_message("shelf", 7, 5000, 0.25, true);
  EXPECT_STREQ(spacing.object, "shelf");
  EXPECT_EQ(spacing.frame, 7u);
  EXPECT_TRUE(spacing.requested);
  EXPECT_EQ(std::get<0>(sim::change_from(spacing, scene)).capture_stamp_ns, 5000);
  fivepipe_v1_ObjectSpacing bad = spacing;
  bad.capture_stamp_ns = -1;
  EXPECT_EQ(text(sim::change_from(bad, scene)).rfind("bad_spacing: shelf: ", 0), 0u);
  bad = spacing;
  bad.spacing_m = NAN;
  EXPECT_EQ(text(sim::change_from(bad, scene)), "bad_spacing: shelf: is not finite");
}

TEST(SpacingMessage, StatesContainPartsAlsoBeforeTheyMove) {
  const config::Scene scene = scene_of({virtual_box("fixed", {5, 5, 5}, {1, 1, 1}), shelf()});
  sim::Simulation simulation(scene, {});
  sim::OutgoingState out = sim::state_message("simulation", 1, 2, 3, scene, simulation.states());
  ASSERT_EQ(out.message().objects._length, 1u);
  EXPECT_STREQ(out.message().objects._buffer[0].object, "shelf");
}

}  // namespace
}  // namespace fivepipe::test
