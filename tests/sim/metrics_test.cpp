// Energy, penetration and contacts that a simulation reports, against closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/geometry/mesh.h"
#include "tests/support/sim_contact.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

config::SceneObject moving(config::SceneObject object) {
  object.motion = config::Motion::dynamic;
  object.reaction = config::Reaction::none;
  return object;
}

// A sheet of 40 x 60 cm whose upper edge, at z = 0, is fixed.
config::SceneObject hanging_sheet() {
  config::SceneObject sheet{.name = "sheet",
                            .shape = config::CurtainShape{0.4, 0.6, 10, 12, 0, 0},
                            .motion = config::Motion::cloth,
                            .reaction = config::Reaction::yield,
                            .cloth = config::ClothSettings{}};
  sheet.cloth->v_rec_world = Vector3d::UnitY();
  const double top_m = geometry::bounds_m(config::mesh_of(sheet)).max().z();
  sheet.world_from_object.translation().z() = -top_m;
  sheet.cloth->pins = {{{Vector3d(-9, -9, top_m - 1e-6), Vector3d(9, 9, top_m + 1e-6)}}};
  return sheet;
}

TEST(SimulationMetrics, AFallingBallKeepsItsEnergyButForTheErrorOfTheSteps) {
  constexpr double kHeight_m = 3, kMass_kg = 0.2;
  sim::Simulation simulation(scene_of({moving(virtual_ball({0, 0, kHeight_m}, 0.5, kMass_kg))}),
                             {});
  for (int frame = 0; frame <= 15; ++frame) {
    simulation.advance_to(frame * kFrame_s);
    const sim::SimulationMetrics metrics = simulation.metrics();
    ASSERT_TRUE(metrics.bodies);
    EXPECT_FALSE(metrics.cloths);
    EXPECT_FALSE(metrics.particles);
    EXPECT_EQ(metrics.bodies->bodies, 1u);
    // Semi-implicit Euler after n steps: v = g h n, z = z0 - g h^2 n (n + 1) / 2.
    const double n = double(simulation.counters().steps), speed_m_s = kGravity_m_s2 * kStep_s * n;
    const double kinetic_j = 0.5 * kMass_kg * speed_m_s * speed_m_s;
    EXPECT_NEAR(metrics.bodies->energy.kinetic_j, kinetic_j, 1e-9);
    const double lost_j = 0.5 * kMass_kg * kGravity_m_s2 * kStep_s * speed_m_s;
    EXPECT_NEAR(metrics.bodies->energy.kinetic_j + metrics.bodies->energy.potential_j,
                kMass_kg * kGravity_m_s2 * kHeight_m - lost_j, 1e-9);
  }
  EXPECT_EQ(simulation.counters().steps, 15u * 8);
  EXPECT_EQ(simulation.metrics().bodies->each_other.pairs, 0u);
  EXPECT_EQ(simulation.metrics().bodies->hull.count, 0u);
}

// The leaf turns about its hinge: m v^2 / 2 and, with I = m (a^2 + b^2) / 12, I w^2 / 2.
TEST(SimulationMetrics, KineticEnergyIncludesTheRotation) {
  config::SceneObject leaf = door();
  leaf.reaction = config::Reaction::none;
  config::Scene scene = scene_of({leaf});
  scene.gravity_m_s2 = 0;
  sim::RigidBodies bodies(scene);
  // The hinge keeps only the rotation that moves the centre, 40 cm from it, at 1 m/s.
  bodies.set_velocity_m_s(0, {0, 1, 0});
  bodies.step(kStep_s);
  const Vector3d center_m = bodies.center_world_m(0);
  const double speed_m_s = bodies.velocity_m_s(0).norm(), turn_rad_s = speed_m_s / 0.4;
  ASSERT_GT(speed_m_s, 0.1);
  EXPECT_NEAR(center_m.z(), 0, 1e-9);
  const double inertia_kg_m2 = 5 * (0.8 * 0.8 + 0.04 * 0.04) / 12;
  EXPECT_NEAR(bodies.kinetic_energy_j(0),
              0.5 * 5 * speed_m_s * speed_m_s + 0.5 * inertia_kg_m2 * turn_rad_s * turn_rad_s,
              1e-9);
}

// The bounce happens at the start of a step, which the ball would end up to v h lower: the error is
// at most m g v h.
TEST(SimulationMetrics, AnElasticBounceOffTheHullKeepsTheEnergy) {
  const auto silhouettes = real_block();
  constexpr double kRadius_m = 0.04, kStart_m = 0.3, kMass_kg = 0.2;
  sim::Simulation simulation(scene_of({touching_ball({0.003, 0.002, kStart_m}, kRadius_m, 1)}), {});
  simulation.advance_to(0, silhouettes);
  const double start_j = kMass_kg * kGravity_m_s2 * kStart_m,
               speed_m_s = std::sqrt(2 * kGravity_m_s2 * (kStart_m - kRadius_m)),
               bound_j = kMass_kg * kGravity_m_s2 * speed_m_s * kStep_s;
  double fastest_up_m_s = 0, worst_j = 0;
  for (int step = 1; step <= 110; ++step) {  // to the next apex
    simulation.advance_to(step * kStep_s);
    fastest_up_m_s = std::max(fastest_up_m_s, velocity_m_s(simulation).z());
    const sim::Energy energy = simulation.metrics().bodies->energy;
    worst_j = std::max(worst_j, std::abs(energy.kinetic_j + energy.potential_j - start_j));
  }
  EXPECT_GT(fastest_up_m_s, 0.9 * speed_m_s) << "it has bounced";
  // The integration loses m g h v / 2 on the way down and regains it on the way up.
  EXPECT_LE(worst_j, 1.5 * bound_j);
  std::printf("elastic bounce: energy within %.2f %% of the drop's\n",
              100 * worst_j / (start_j - kMass_kg * kGravity_m_s2 * kRadius_m));
}

TEST(SimulationMetrics, AClothAtRestHasOnlyPotentialEnergy) {
  const config::SceneObject sheet = hanging_sheet();
  sim::Simulation simulation(scene_of({sheet}), {});
  simulation.advance_to(0);
  // The free rows are 5 cm apart, below the fixed one: 11 of M / 12 and the last of M / 24. Their
  // moment is that of the whole sheet, M h / 2.
  const double mass_kg = sheet.cloth->density_kg_m2 * 0.4 * 0.6;
  const double start_j = -mass_kg * kGravity_m_s2 * 0.6 / 2;
  const auto at_start = simulation.metrics().cloths;
  ASSERT_TRUE(at_start);
  EXPECT_EQ(at_start->cloths, 1u);
  EXPECT_EQ(at_start->energy.kinetic_j, 0);
  EXPECT_NEAR(at_start->energy.potential_j, start_j, 1e-12);
  double fastest_j = 0;
  for (int frame = 1; frame <= 240; ++frame) {
    simulation.advance_to(frame * kFrame_s);
    fastest_j = std::max(fastest_j, simulation.metrics().cloths->energy.kinetic_j);
  }
  const sim::Energy rest = simulation.metrics().cloths->energy;
  // A free fall by 1 mm has a thousandth of this energy.
  const double fall_j = mass_kg * kGravity_m_s2 * 1e-3;
  EXPECT_LT(rest.kinetic_j, 1e-3 * fall_j);
  EXPECT_GT(fastest_j, rest.kinetic_j);
  EXPECT_LE(rest.potential_j, start_j);
  EXPECT_GT(rest.potential_j, 1.05 * start_j) << "stretched by its own weight";
  EXPECT_FALSE(simulation.metrics().bodies);
}

TEST(SimulationMetrics, TheOverlapOfTwoBodiesIsThatOfTheirPoses) {
  constexpr double kEdge_m = 0.04, kOverlap_m = 0.003;
  const Vector3d size_m = Vector3d::Constant(kEdge_m);
  config::Scene scene = scene_of({moving(virtual_box("low", {0, 0, 0}, size_m)),
                                  moving(virtual_box("high", {0, 0, kEdge_m - kOverlap_m}, size_m)),
                                  moving(virtual_box("apart", {0.2, 0, 0}, size_m))});
  scene.gravity_m_s2 = 0;
  sim::RigidBodies bodies(scene);
  EXPECT_EQ(bodies.contacts().pairs, 0u) << "nothing is detected before the first step";
  bodies.step(kStep_s);
  const double overlap_m = kEdge_m - (bodies.center_world_m(1).z() - bodies.center_world_m(0).z());
  ASSERT_GT(overlap_m, 0.001);
  EXPECT_EQ(bodies.contacts().pairs, 1u);
  EXPECT_NEAR(bodies.contacts().deepest_m, overlap_m, 1e-9);
  bodies.translate(1, {0, 0, -0.002});
  EXPECT_NEAR(bodies.contacts().deepest_m, overlap_m + 0.002, 1e-9) << "of the present poses";
  bodies.translate(1, {1, 0, 0});
  EXPECT_EQ(bodies.contacts().pairs, 0u) << "it has left the contact";
  EXPECT_EQ(bodies.contacts().deepest_m, 0);
}

// The block's top is at z = 0, so the ball's depth follows from its pose. The contact's plane is
// within kPlaneTolerance pixels of 2 mm.
TEST(SimulationMetrics, TheDepthInTheHullIsThatOfThePose) {
  const auto silhouettes = real_block();
  constexpr double kRadius_m = 0.04, kPixel_m = 0.002;
  sim::Simulation simulation(
      scene_of({touching_ball({0.01, 0.02, kRadius_m - 0.015}, kRadius_m, 0.5, 0.5),
                touching_ball({0, 0, 1}, kRadius_m, 0.5)}),
      {});
  simulation.advance_to(0, silhouettes);
  EXPECT_EQ(simulation.metrics().bodies->hull.count, 0u) << "no step has queried the hull";
  for (int step = 1; step <= 5; ++step) {
    simulation.advance_to(step * kStep_s);
    const sim::HullContacts hull = simulation.metrics().bodies->hull;
    EXPECT_EQ(hull.count, 1u);
    EXPECT_NEAR(hull.deepest_m, std::max(0.0, kRadius_m - center_m(simulation).z()),
                sim::kPlaneTolerance * kPixel_m)
        << step;
    if (step == 1) {
      EXPECT_GT(hull.deepest_m, 0.005);  // a half of 15 mm, within the tolerance
    }
  }
  simulation.advance_to(5 * kStep_s, silhouettes);
  EXPECT_EQ(simulation.metrics().bodies->hull.count, 0u) << "no step has queried the newest hull";
  simulation.advance_to(6 * kStep_s);
  EXPECT_EQ(simulation.metrics().bodies->hull.count, 1u);
  simulation.reset();
  EXPECT_EQ(simulation.metrics().bodies->hull.count, 0u);
}

TEST(SimulationMetrics, ABallThatBouncesCountsWhereTheLastQueryFoundIt) {
  const auto silhouettes = seen({ball(kOrigin, 0.15)});
  sim::Simulation simulation(scene_of({virtual_ball(kOrigin)}), {});
  simulation.advance_to(0, silhouettes);
  simulation.advance_to(2 * kStep_s);
  EXPECT_EQ(simulation.metrics().bodies->hull.count, 1u);
  EXPECT_EQ(simulation.metrics().bodies->hull.deepest_m, 0) << "without an exit it is not known";
  EXPECT_EQ(simulation.counters().unrecovered, 1u);
  simulation.reset();
  EXPECT_EQ(simulation.metrics().bodies->hull.count, 0u);
}

TEST(SimulationMetrics, AreAbsentWithoutAnObjectThatMoves) {
  const config::Scene fixed = scene_of({virtual_box("box", kOrigin, {0.1, 0.1, 0.1})});
  EXPECT_FALSE(config::moves_objects(fixed));
  sim::Simulation simulation(fixed, {});
  simulation.advance_to(0, real_block());
  simulation.advance_to(kFrame_s);
  EXPECT_FALSE(simulation.metrics().bodies);
  EXPECT_FALSE(simulation.metrics().cloths);
  EXPECT_FALSE(simulation.metrics().particles);
  config::Scene raining = fixed;
  raining.particles.emplace_back().name = "rain";
  EXPECT_TRUE(config::moves_objects(raining));
  EXPECT_TRUE(config::moves_objects(scene_of({moving(virtual_ball(kOrigin))})));
  EXPECT_TRUE(config::moves_objects(scene_of({hanging_sheet()})));
}

}  // namespace
}  // namespace fivepipe::test
