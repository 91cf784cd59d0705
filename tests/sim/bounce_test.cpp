// Contact of virtual objects with the hull: reports, and how a ball bounces.
#include "sim_node/contact/bounce.h"
#include "tests/support/sim_scene.h"

namespace fivepipe::test {
namespace {

class SimulationBounce : public GlTest {};

// A real bar with a radius of 3 cm, seen by cameras on its horizon. The ball falls on it from
// above.
std::vector<hull::Silhouette> bar() {
  return silhouettes_of({{{0, -0.15, 0}, {0, 0.15, 0}, 0.03}}, ring(5, 1.5, 0, 300, 0.6));
}

collision::Response response_up(double d_rec_m, double error_m = 0) {
  collision::Response response;
  response.status = collision::RecoveryStatus::recovered;
  response.v_rec_world = Eigen::Vector3d::UnitZ();
  response.d_rec_m = d_rec_m;
  response.d_rec_error_m = error_m;
  return response;
}

double energy_J_kg(const Eigen::Vector3d& velocity_m_s, double height_m) {
  return 0.5 * velocity_m_s.squaredNorm() + kGravity_m_s2 * height_m;
}

TEST(Bounce, ReversesOnlyTheVelocityAlongTheNormal) {
  collision::Response response = response_up(0.0);
  response.four_points.status = collision::NormalStatus::defined;
  response.four_points.normal_world = Eigen::Vector3d(0.6, 0, 0.8);
  const sim::Bounce after = sim::bounce(response, {0, 0.3, -2}, 1.0, kGravity_m_s2, 0.1);
  EXPECT_NEAR(after.velocity_world_m_s.dot(response.four_points.normal_world), 1.6, 1e-12);
  EXPECT_NEAR(after.velocity_world_m_s.y(), 0.3, 1e-12);
  EXPECT_NEAR(after.velocity_world_m_s.norm(), std::hypot(0.3, 2.0), 1e-12);
}

TEST(Bounce, IgnoresSeparatingObjects) {
  EXPECT_EQ(sim::bounce(response_up(0.01), {0, 0, 1}, 1.0, kGravity_m_s2, 0.1).velocity_world_m_s,
            Eigen::Vector3d(0, 0, 1));
  EXPECT_NEAR(
      (sim::bounce(response_up(0.01, 0.002), {0, 0, 1}, 1.0, kGravity_m_s2, 0.1).move_world_m -
       Eigen::Vector3d(0, 0, 0.012))
          .norm(),
      0, 1e-15);
}

struct BounceCase {
  const char* description;
  collision::RecoveryStatus status;
  Eigen::Vector3d v_rec_world, velocity_m_s, move_m, velocity_after_m_s;
};

// Gravity 10 m/s2, restitution 0.5, rest below 0.25 m/s. The hull ends after 5 cm, with an error of
// 1 cm and a residual of 2 cm.
TEST(Bounce, MatchesTheFormulas) {
  using Eigen::Vector3d;
  constexpr auto kRecovered = collision::RecoveryStatus::recovered;
  const Vector3d x = Vector3d::UnitX(), y = Vector3d::UnitY(), z = Vector3d::UnitZ();
  const double lifted_m_s = std::sqrt(2.0 * 2.0 - 2 * 10 * 0.08);
  for (const BounceCase& expected : {
           BounceCase{"lift", kRecovered, z, {0.3, 0, -2}, 0.08 * z, {0.3, 0, 0.5 * lifted_m_s}},
           {"no residual",
            collision::RecoveryStatus::still_colliding,
            z,
            {0, 0, -2},
            0.06 * z,
            0.5 * std::sqrt(4.0 - 2 * 10 * 0.06) * z},
           {"the lift exceeds the energy", kRecovered, z, {0.3, 0, -1.2}, 0.08 * z, 0.3 * x},
           {"down", kRecovered, -z, 2 * z, -0.08 * z, -z},
           {"slow", kRecovered, x, {-0.5, 0.125, 0}, 0.08 * x, {0.25, 0.125, 0}},
           {"as slow as at rest", kRecovered, x, {-0.25, 1, 0}, 0.08 * x, y},
           {"barely faster than at rest", kRecovered, x, -0.26 * x, 0.08 * x, 0.13 * x},
           {"sideways", kRecovered, x, y, 0.08 * x, y},
           {"away", kRecovered, x, {0.5, 1, 0}, 0.08 * x, {0.5, 1, 0}},
       }) {
    collision::Response response = response_up(0.05, 0.01);
    response.status = expected.status;
    response.residual_m = 0.02;
    response.v_rec_world = expected.v_rec_world;
    const sim::Bounce after = sim::bounce(response, expected.velocity_m_s, 0.5, 10, 0.25);
    EXPECT_LT((after.move_world_m - expected.move_m).norm(), 1e-12) << expected.description;
    EXPECT_LT((after.velocity_world_m_s - expected.velocity_after_m_s).norm(), 1e-12)
        << expected.description;
  }
}

TEST(Bounce, EnergyGrowsByAtMostTheLift) {
  Random random(31);
  for (int i = 0; i < 10000; ++i) {
    collision::Response response = response_up(uniform(random, 0, 0.05));
    response.v_rec_world = random_direction(random);
    if (i % 2) {
      response.four_points.status = collision::NormalStatus::defined;
      response.four_points.normal_world = random_direction(random);
    }
    const Eigen::Vector3d before_m_s = random_vector(random, 0, 4);
    const sim::Bounce after =
        sim::bounce(response, before_m_s, uniform(random, 0, 1), kGravity_m_s2, 0.1);
    const double gain =
        energy_J_kg(after.velocity_world_m_s, after.move_world_m.z()) - energy_J_kg(before_m_s, 0);
    EXPECT_LE(gain, kGravity_m_s2 * std::max(0.0, after.move_world_m.z()) + 1e-12);
    const Eigen::Vector3d& normal =
        i % 2 ? response.four_points.normal_world : response.v_rec_world;
    const double approach_m_s = -before_m_s.dot(normal);
    if (approach_m_s > 0 &&
        approach_m_s * approach_m_s > 2 * kGravity_m_s2 * std::max(0.0, after.move_world_m.z())) {
      EXPECT_LE(gain, 1e-12);
    }
  }
}

TEST_F(SimulationBounce, BallBouncesOffARealBarAndEnergyNeverGrows) {
  const auto silhouettes = bar();
  for (const double restitution : {0.0, 0.5, 1.0}) {
    sim::Simulation simulation(scene_of({virtual_ball({0, 0, 0.3}, restitution)}), {});
    double energy = mechanical_energy_J_kg(simulation.states()[0], kGravity_m_s2), lowest_m = 1,
           highest_after_m = 0;
    bool has_bounced = false;
    for (int step = 0; step <= 240; ++step) {
      simulation.advance_to(step / 240.0, silhouettes);
      const sim::ObjectState state = simulation.states()[0];
      const double now = mechanical_energy_J_kg(state, kGravity_m_s2);
      // The bounce reduces the speed by the energy of the lift. At rest, the ball is lifted by its
      // fall since the last query, which is two steps ago.
      EXPECT_LE(now, energy + kGravity_m_s2 * 0.003)
          << "restitution " << restitution << " at " << step;
      energy = now;
      ASSERT_TRUE(all_finite(simulation));
      const bool contact = simulation.collisions()[0].response.has_value();
      if (contact) {
        EXPECT_TRUE(simulation.collisions()[0].collision.colliding());
      }
      if (contact && !has_bounced) {
        has_bounced = true;
        EXPECT_EQ(simulation.collisions()[0].response->status,
                  collision::RecoveryStatus::recovered);
      }
      const double z_m = state.world_from_object.translation().z();
      lowest_m = std::min(lowest_m, z_m);
      if (has_bounced) highest_after_m = std::max(highest_after_m, z_m);
    }
    EXPECT_TRUE(has_bounced);
    EXPECT_LE(energy, kGravity_m_s2 * 0.3) << restitution;
    if (restitution == 1.0) {
      EXPECT_GT(highest_after_m,
                0.18);  // 0.3 m minus the losses of the steps and of the penetration
    }
    if (restitution == 0.0) {
      EXPECT_LT(highest_after_m, 0.03 + kBallRadius_m + 0.01);
    }
  }
}

TEST_F(SimulationBounce, BallAtThreeMetresPerSecondDoesNotTunnelThroughABar) {
  const auto silhouettes = bar();
  // From 0.55 m: 3 m/s at the bar, 10 cm per frame of 1/30 s.
  sim::Simulation simulation(scene_of({virtual_ball({0.002, 0, 0.55}, 0.5)}), {});
  double lowest_m = 1;
  for (int frame = 0; frame <= 15; ++frame) {
    simulation.advance_to(frame * kFrame_s, silhouettes);
    lowest_m = std::min(lowest_m, simulation.states()[0].world_from_object.translation().z());
  }
  EXPECT_GT(simulation.counters().contacts, 0u);
  EXPECT_GT(lowest_m, 0.03);  // the centre stays outside the bar
}

TEST_F(SimulationBounce, LightAndHeavyBallsBounceAlike) {
  const auto silhouettes = bar();
  std::vector<Eigen::Vector3d> positions_m;
  for (const double mass_kg : {0.001, 1.0, 1000.0}) {
    sim::Simulation simulation(scene_of({virtual_ball({0, 0, 0.2}, 0.5, mass_kg)}), {});
    for (int frame = 0; frame <= 15; ++frame) simulation.advance_to(frame * kFrame_s, silhouettes);
    positions_m.push_back(simulation.states()[0].world_from_object.translation());
  }
  EXPECT_LT((positions_m[0] - positions_m[1]).norm(), 1e-6);
  EXPECT_LT((positions_m[2] - positions_m[1]).norm(), 1e-6);
}

TEST_F(SimulationBounce, GpuAndCpuBackendsGiveTheSameMotion) {
  const auto silhouettes = bar();
  std::vector<Eigen::Vector3d> positions_m;
  for (const config::CollisionBackend backend :
       {config::CollisionBackend::cpu, config::CollisionBackend::gl}) {
    sim::Simulation simulation(scene_of({virtual_ball({0, 0, 0.2}, 0.5)}), {.collision = backend});
    for (int frame = 0; frame <= 15; ++frame) simulation.advance_to(frame * kFrame_s, silhouettes);
    positions_m.push_back(simulation.states()[0].world_from_object.translation());
    EXPECT_GT(simulation.counters().contacts, 0u);
    EXPECT_EQ(simulation.counters().detection.points_unconfirmed, 0u);
  }
  EXPECT_LT((positions_m[0] - positions_m[1]).norm(),
            1e-3);  // collision points may differ by their spacing
}

TEST_F(SimulationBounce, RestsOnTheHullForAllStepSizes) {
  // A gutter of two real bars, closed by virtual walls. Two cameras look along it; without them the
  // hull would fill the gutter.
  std::vector<geometry::Camera> cameras = ring(3, 1.5, 0.6, 300, 0.6);
  for (const double y_m : {-1.5, 1.5}) cameras.push_back(camera_at({0, y_m, 0}, 300, 0.6));
  const auto silhouettes = silhouettes_of(
      {{{-0.05, -0.15, 0}, {-0.05, 0.15, 0}, 0.03}, {{0.05, -0.15, 0}, {0.05, 0.15, 0}, 0.03}},
      cameras);
  for (const double step_s : {1.0 / 240, 1.0 / 120, 1.0 / 60}) {
    sim::Simulation simulation(scene_of({virtual_ball({0, 0, 0.085}, 0.3),
                                         virtual_box("near", {0, -0.09, 0.1}, {0.2, 0.05, 0.2}),
                                         virtual_box("far", {0, 0.09, 0.1}, {0.2, 0.05, 0.2})}),
                               {.step_s = step_s});
    double lowest_m = 1, highest_m = 0;
    for (int frame = 0; frame <= 60; ++frame) {
      simulation.advance_to(frame * kFrame_s, silhouettes);
      const double z_m = simulation.states()[0].world_from_object.translation().z();
      if (frame > 30) lowest_m = std::min(lowest_m, z_m), highest_m = std::max(highest_m, z_m);
    }
    EXPECT_EQ(simulation.counters().respawned, 0u) << step_s;
    // On the exact bars the ball rests at sqrt(0.09^2 - 0.05^2) m. Touched pixels of 2 mm raise it;
    // flat triangles, samples 2 mm apart and the fall between queries lower it.
    EXPECT_NEAR(lowest_m, 0.0748, 0.005) << step_s;
    EXPECT_LT(highest_m - lowest_m, 0.008) << step_s;
  }
}

TEST_F(SimulationBounce, HullInsideTheBallHasNoEffectAndIsReported) {
  sim::Simulation simulation(
      scene_of({virtual_ball({0, 0, 0}), virtual_box("floor", {0, 0, -0.11}, {1, 1, 0.1})}), {});
  for (int frame = 0; frame <= 5; ++frame) simulation.advance_to(frame * kFrame_s, {});
  EXPECT_EQ(simulation.collisions()[0].collision.verdict, collision::CollisionVerdict::free);
  const auto silhouettes = seen({ball(kOrigin, 0.02)});
  for (int frame = 6; frame <= 20; ++frame) simulation.advance_to(frame * kFrame_s, silhouettes);
  EXPECT_FALSE(simulation.collisions()[0].collision.colliding());
  // No point of the ball's surface is in the hull, but its box contains hull points.
  EXPECT_TRUE(simulation.collisions()[0].collision.hull_in_box);
  EXPECT_TRUE(all_finite(simulation));
  EXPECT_NEAR(simulation.states()[0].world_from_object.translation().z(), 0, 0.002);
}

TEST_F(SimulationBounce, EnclosingHullIsCountedAndAddsNoEnergy) {
  sim::Simulation simulation(
      scene_of({virtual_ball({0, 0, 0}, 1.0), virtual_box("floor", {0, 0, -0.11}, {1, 1, 0.1})}),
      {});
  const auto silhouettes = seen({ball(kOrigin, 0.15)});
  for (int frame = 0; frame <= 20; ++frame) simulation.advance_to(frame * kFrame_s, silhouettes);
  EXPECT_GT(simulation.counters().unrecovered, 0u);
  EXPECT_EQ(simulation.collisions()[0].response->status,
            collision::RecoveryStatus::reference_inside);
  EXPECT_LT(simulation.states()[0].velocity_world_m_s.norm(), 0.05);
}

TEST_F(SimulationBounce, HighlightIsReportedButNotMovedAndNoneIsNotQueried) {
  config::SceneObject curtain{.name = "curtain",
                              .shape = config::CurtainShape{0.4, 0.3, 20, 18, 0.02, 3},
                              .world_from_object = at({0, 0, 0.15})};
  sim::Simulation simulation(scene_of({curtain, virtual_box("ghost", kOrigin, {0.2, 0.2, 0.2})}),
                             {.max_points = 5});
  const auto silhouettes = seen({{{0, -0.1, 0}, {0, 0.1, 0}, 0.03}});
  for (int frame = 0; frame <= 3; ++frame) simulation.advance_to(frame * kFrame_s, silhouettes);
  ASSERT_EQ(simulation.collisions().size(), 1u);
  const sim::CollisionReport& report = simulation.collisions()[0];
  EXPECT_EQ(report.name, "curtain");
  EXPECT_TRUE(report.collision.colliding());
  EXPECT_GT(report.collision.triangles.size(), 5u);
  EXPECT_EQ(report.collision.points.size(), 5u);
  EXPECT_TRUE(report.truncated);
  EXPECT_FALSE(report.response);
  EXPECT_EQ(simulation.counters().detection.objects, 4u);  // one query per frame
  EXPECT_EQ(simulation.states()[0].world_from_object.translation(), Eigen::Vector3d(0, 0, 0.15));
}

// A reset after an odd number of steps, between two queries of the hull.
TEST_F(SimulationBounce, AfterAResetTheBallBouncesAsFromTheStart) {
  const auto silhouettes = bar();
  const config::Scene scene = scene_of({virtual_ball({0, 0, 0.12})});
  sim::Simulation simulation(scene, {}), fresh(scene, {});
  simulation.advance_to(0, silhouettes);
  simulation.advance_to(3 / 240.0, silhouettes);
  simulation.reset();
  fresh.advance_to(3 / 240.0, silhouettes);
  for (int step = 4; step <= 64; ++step)
    for (sim::Simulation* one : {&simulation, &fresh}) one->advance_to(step / 240.0, silhouettes);
  EXPECT_GT(fresh.counters().contacts, 0u);
  EXPECT_EQ(simulation.counters().contacts, fresh.counters().contacts);
  EXPECT_EQ(simulation.states()[0].world_from_object.matrix(),
            fresh.states()[0].world_from_object.matrix());
}

TEST_F(SimulationBounce, HeldHullSupportsTheBall) {
  // Maps at 5 Hz in a simulation at 240 Hz: the last hull is held between them.
  sim::Simulation simulation(scene_of({virtual_ball({0, 0, 0.12}, 0)}), {});
  for (int frame = 0; frame <= 30; ++frame) {
    const double bar_z_m = 0.01 * double(frame / 6);  // a rising hand
    const auto held = silhouettes_of({{{-0.05, -0.15, bar_z_m}, {-0.05, 0.15, bar_z_m}, 0.03},
                                      {{0.05, -0.15, bar_z_m}, {0.05, 0.15, bar_z_m}, 0.03}},
                                     ring(5, 1.5, 0, 300, 0.6));
    simulation.advance_to(frame * kFrame_s, held);
  }
  EXPECT_GT(simulation.states()[0].world_from_object.translation().z(), 0.05 + 0.03);
  EXPECT_EQ(simulation.counters().respawned, 0u);
}

TEST_F(SimulationBounce, IsBitIdenticalForOneAndTwoThreads) {
  const auto silhouettes = seen({{{0.01, -0.15, 0}, {0, 0.15, 0.02}, 0.03}});
  config::Scene scene =
      scene_of({virtual_ball({0, 0, 0.3}),
                virtual_box("floor", {0, 0, -0.2}, {2, 2, 0.1}, config::Reaction::highlight)});
  scene.objects[0].requests.proximity =
      config::ProximityRequests{config::ProximityOf::triangles, 0.2, 0.002};
  scene.objects[0].requests.response = config::ResponseRequests{
      .v_rec_world = std::nullopt, .closed_form = true, .local_minimum_translation = true};
  scene.objects[0].requests.contacts = 4;
  sim::Simulation first(scene, {}), second(scene, {.threads = 2});
  for (int frame = 0; frame <= 60; ++frame) {
    for (sim::Simulation* simulation : {&first, &second})
      simulation->advance_to(100 + frame * kFrame_s, silhouettes);
    for (std::size_t i = 0; i < scene.objects.size(); ++i) {
      ASSERT_EQ(first.states()[i].world_from_object.matrix(),
                second.states()[i].world_from_object.matrix());
      ASSERT_EQ(first.states()[i].velocity_world_m_s, second.states()[i].velocity_world_m_s);
    }
    for (std::size_t i = 0; i < first.collisions().size(); ++i) {
      const sim::CollisionReport &one = first.collisions()[i], &two = second.collisions()[i];
      ASSERT_EQ(one.collision.points, two.collision.points);
      ASSERT_EQ(one.details.proximity, two.details.proximity);
      ASSERT_EQ(one.details.contacts.has_value(), two.details.contacts.has_value());
      if (one.details.local_minimum_translation) {
        ASSERT_EQ(one.details.local_minimum_translation->translation_world_m,
                  two.details.local_minimum_translation->translation_world_m);
      }
    }
  }
  EXPECT_GT(first.counters().contacts, 0u);
}

}  // namespace
}  // namespace fivepipe::test
