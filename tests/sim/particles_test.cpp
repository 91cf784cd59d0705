// Particles: flight, contact with the scene's objects and with the hull.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim_node/particles/particle_response.h"
#include "tests/support/not_finite.h"
#include "tests/support/sim_contact.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

config::ParticleSource source_at(const Eigen::AlignedBox3d& from_m, double rate_hz,
                                 double lifetime_s) {
  config::ParticleSource source;
  source.name = "grains";
  source.from_world_m = from_m;
  source.rate_hz = rate_hz;
  source.lifetime_s = lifetime_s;
  source.drag_1_s = 0;
  return source;
}
Eigen::AlignedBox3d box(const Vector3d& center_m, const Vector3d& half_m) {
  return {Vector3d(center_m - half_m), Vector3d(center_m + half_m)};
}

// A scene with a source and, out of the way, an object, which every scene needs.
config::Scene scene_with(const config::ParticleSource& source,
                         std::vector<config::SceneObject> objects = {}) {
  objects.push_back(virtual_box("far", {0, 0, -2}, {0.1, 0.1, 0.1}));
  config::Scene scene = scene_of(std::move(objects));
  scene.particles = {source};
  return scene;
}

double deepest_m(const std::vector<hull::Silhouette>& silhouettes, const sim::ParticleSet& of) {
  double deepest_m = 0;
  for (const Vector3d& p_m : of.p_world_m) {
    if (!hull::in_hull(silhouettes, p_m)) continue;
    // The nearest point outside, along 26 directions.
    double nearest_m = 0.05;
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        for (int z = -1; z <= 1; ++z) {
          if (x == 0 && y == 0 && z == 0) continue;
          const Vector3d direction = Vector3d(x, y, z).normalized();
          double way_m = 0;
          while (way_m < nearest_m && hull::in_hull(silhouettes, p_m + way_m * direction))
            way_m += 1e-4;
          nearest_m = std::min(nearest_m, way_m);
        }
    deepest_m = std::max(deepest_m, nearest_m);
  }
  return deepest_m;
}

TEST(Particles, FallFreelyAtTheSourcesRateForTheirLifetime) {
  config::ParticleSource source = source_at(box({0, 0, 1}, {0, 0, 0}), 100, 0.5);
  source.velocity_world_m_s = {1, 0, 2};
  sim::Simulation simulation(scene_with(source), {});
  simulation.advance_to(0);
  simulation.advance_to(0.25);
  EXPECT_EQ(simulation.particles(0).size(), 25u);
  simulation.advance_to(0.5);
  simulation.advance_to(0.75);
  simulation.advance_to(1.0);
  const sim::ParticleSet& particles = simulation.particles(0);
  EXPECT_NEAR(double(particles.size()), 50, 1);
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const double t_s = particles.age_s[i];
    EXPECT_LT(t_s, 0.5);
    const Vector3d expected_m = Vector3d(0, 0, 1) + t_s * source.velocity_world_m_s -
                                Vector3d(0, 0, 0.5 * kGravity_m_s2 * t_s * t_s);
    // The error of semi-implicit Euler is half a step of fall.
    EXPECT_LT((particles.p_world_m[i] - expected_m).norm(),
              0.5 * kGravity_m_s2 * kStep_s * (t_s + kStep_s) + 1e-9);
  }
}

TEST(Particles, DragEndsInTheTerminalSpeed) {
  config::ParticleSource source = source_at(box({0, 0, 1}, {0, 0, 0}), 10, 10);
  source.drag_1_s = 20;
  sim::Simulation simulation(scene_with(source), {});
  for (int i = 0; i <= 20; ++i) simulation.advance_to(0.1 * i);
  EXPECT_NEAR(simulation.particles(0).v_world_m_s[0].z(), -kGravity_m_s2 / 20, 1e-3);
}

TEST(Particles, StartInTheSourcesBoxWithItsSpread) {
  config::ParticleSource source = source_at(box({0.1, 0.2, 1}, {0.05, 0.1, 0.02}), 20000, 1);
  source.spread_m_s = 0.5;
  config::Scene scene = scene_with(source);
  scene.gravity_m_s2 = 0;
  sim::Simulation simulation(scene, {});
  simulation.advance_to(0);
  simulation.advance_to(0.2);
  const sim::ParticleSet& particles = simulation.particles(0);
  ASSERT_EQ(particles.size(), 4000u);
  Vector3d mean_m = Vector3d::Zero(), mean_m_s = Vector3d::Zero();
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const Vector3d start_m = particles.p_world_m[i] - particles.age_s[i] * particles.v_world_m_s[i];
    EXPECT_LT(
        ((start_m - source.from_world_m.center()).cwiseAbs() - 0.5 * source.from_world_m.sizes())
            .maxCoeff(),
        1e-9);
    EXPECT_LE(particles.v_world_m_s[i].norm(), 0.5 + 1e-12);
    mean_m += start_m / 4000;
    mean_m_s += particles.v_world_m_s[i] / 4000;
  }
  EXPECT_LT((mean_m - source.from_world_m.center()).norm(), 0.005);
  EXPECT_LT(mean_m_s.norm(), 0.02);
}

// Grains on a virtual table come to rest at their radius above it.
TEST(Particles, RestOnAVirtualTable) {
  const config::ParticleSource source = source_at(box({0, 0, 0.1}, {0.1, 0.1, 0}), 500, 10);
  sim::Simulation simulation(
      scene_with(source, {virtual_box("table", {0, 0, -0.02}, {1, 1, 0.04})}), {});
  for (int frame = 0; frame <= 90; ++frame) simulation.advance_to(frame * kFrame_s);
  int at_rest = 0;
  const sim::ParticleSet& particles = simulation.particles(0);
  for (std::size_t i = 0; i < particles.size(); ++i) {
    EXPECT_GE(particles.p_world_m[i].z(), source.radius_m - 1e-9);
    if (particles.age_s[i] < 2) continue;
    ++at_rest;
    EXPECT_NEAR(particles.p_world_m[i].z(), source.radius_m, 1e-9);
    EXPECT_LT(particles.v_world_m_s[i].norm(), 1e-9);
  }
  EXPECT_GT(at_rest, 400);
}

TEST(Particles, SlideDownATiltedTableAsCoulombFrictionDemands) {
  for (const double friction : {0.0, 0.2, 0.9}) {
    constexpr double kTilt_rad = 0.5;
    config::SceneObject table = virtual_box("table", kOrigin, {2, 2, 0.02});
    table.world_from_object = Eigen::AngleAxisd(kTilt_rad, Vector3d::UnitY());
    // One particle, which starts at rest on the table.
    config::ParticleSource source = source_at(
        box(table.world_from_object * Vector3d(-0.2, 0, 0.01 + 0.003), {0, 0, 0}), 1, 100);
    source.friction = friction;
    sim::Simulation simulation(scene_with(source, {table}), {});
    for (int i = 0; i <= 150; ++i) simulation.advance_to(0.01 * i);
    const double slope_m_s2 =
        kGravity_m_s2 * std::max(0.0, std::sin(kTilt_rad) - friction * std::cos(kTilt_rad));
    EXPECT_NEAR(simulation.particles(0).v_world_m_s[0].norm(), 0.5 * slope_m_s2, 0.03) << friction;
  }
}

TEST(Particles, BounceOffAVirtualBallThatMoves) {
  config::SceneObject ball = virtual_ball({0, 0, 0});
  ball.reaction = config::Reaction::none;
  ball.velocity_world_m_s = {0, 0, 3};
  config::ParticleSource source = source_at(box({0, 0, 0.2}, {0.005, 0.005, 0}), 200, 10);
  source.restitution = 1;
  config::Scene scene = scene_with(source, {ball});
  scene.gravity_m_s2 = 0;
  sim::Simulation simulation(scene, {});
  for (int i = 0; i <= 20; ++i) simulation.advance_to(0.01 * i);
  const sim::ParticleSet& particles = simulation.particles(0);
  int struck = 0;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const Vector3d ball_m = simulation.states()[0].world_from_object.translation();
    EXPECT_GE((particles.p_world_m[i] - ball_m).norm(), kBallRadius_m + source.radius_m - 1e-9);
    if (particles.v_world_m_s[i].norm() < 0.1) continue;
    ++struck;
    EXPECT_NEAR(particles.v_world_m_s[i].z(), 6, 0.3);
  }
  EXPECT_GT(struck, 5);
}

// A board 1 cm thick moves 4 cm per step. Particles in its way end up in front of it.
TEST(Particles, AreSweptByABoardThatPassesThemWithinAStep) {
  config::SceneObject board = virtual_box("board", {-0.5, 0, 0}, {0.01, 1, 1});
  board.motion = config::Motion::dynamic;
  board.velocity_world_m_s = {10, 0, 0};
  config::Scene scene = scene_with(source_at(box(kOrigin, {0.02, 0.1, 0.1}), 5000, 10), {board});
  scene.gravity_m_s2 = 0;
  sim::Simulation simulation(scene, {});
  for (int step = 0; step <= 16; ++step) simulation.advance_to(step * kStep_s);
  const double front_m = simulation.states()[0].world_from_object.translation().x() + 0.005;
  ASSERT_NEAR(front_m, -0.5 + 16 * kStep_s * 10 + 0.005, 1e-6);
  const sim::ParticleSet& particles = simulation.particles(0);
  int swept = 0;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    if (particles.age_s[i] < 5 * kStep_s) continue;  // it may have started behind the board
    ++swept;
    EXPECT_GE(particles.p_world_m[i].x(), front_m) << i;
  }
  EXPECT_GT(swept, 200);
}

// The impulse of a bounce is (1 + restitution) times the approach, per mass. Coulomb friction
// reduces the velocity along the surface by at most `friction` times that.
TEST(Particles, FrictionOfABounceIsThatOfItsWholeImpulse) {
  config::ParticleSource source;
  source.radius_m = 0.003, source.restitution = 0.5, source.friction = 0.2;
  Vector3d p_m(0, 0, 0.001), v_m_s(2, 0, -1);
  EXPECT_TRUE(
      sim::respond(source, {.normal_world = Vector3d::UnitZ(), .distance_m = 0.001}, p_m, v_m_s));
  EXPECT_EQ(p_m, Vector3d(0, 0, 0.003));
  EXPECT_LT((v_m_s - Vector3d(2 - 0.2 * 1.5, 0, 0.5)).norm(), 1e-12) << v_m_s.transpose();
}

// A curtain that hangs across the way, and a door leaf given as a mesh.
TEST(Particles, AreStoppedByClothAndMeshes) {
  for (const bool is_cloth : {true, false}) {
    config::SceneObject sheet{.name = "sheet",
                              .shape = config::CurtainShape{1, 1, 10, 10, 0.01, 2},
                              .world_from_object = at({0, 0, 0.5}),
                              .reaction = config::Reaction::none};
    if (is_cloth) {
      sheet.motion = config::Motion::cloth;
      sheet.cloth.emplace();
      sheet.cloth->pins = {{{Vector3d(-1, -1, -1e-6), Vector3d(1, 1, 1e-6)}, {}}};
    }
    config::ParticleSource source = source_at(box({0, -0.1, 0.2}, {0.2, 0, 0.1}), 500, 10);
    source.velocity_world_m_s = {0, 8, 0};
    config::Scene scene = scene_with(source, {sheet});
    sim::Simulation simulation(scene, {});
    for (int frame = 0; frame <= 15; ++frame) simulation.advance_to(frame * kFrame_s);
    const sim::ParticleSet& particles = simulation.particles(0);
    EXPECT_GT(particles.size(), 200u);
    for (const Vector3d& p_m : particles.p_world_m)
      if (p_m.z() > -0.4) {
        EXPECT_LT(p_m.y(), 0.05) << is_cloth;
      }
  }
}

// At 100 m/s a particle flies up to 0.42 m in the step in which it starts, and the board is 0.1 m
// away.
TEST(Particles, AreStoppedInTheStepInWhichTheyStart) {
  config::ParticleSource source = source_at(box({0, -0.1, 0}, {0, 0, 0}), 1000, 1);
  source.velocity_world_m_s = {0, 100, 0};
  source.spread_m_s = 0;
  config::Scene scene = scene_with(source, {virtual_box("board", {0, 0.005, 0}, {2, 0.01, 2})});
  sim::Simulation simulation(scene, {});
  for (int frame = 0; frame <= 3; ++frame) simulation.advance_to(frame * kFrame_s);
  EXPECT_GT(simulation.particles(0).size(), 50u);
  for (const Vector3d& p_m : simulation.particles(0).p_world_m) EXPECT_LT(p_m.y(), 0);
}

TEST(Particles, RestOnARealBlock) {
  const auto silhouettes = real_block();
  const config::ParticleSource source = source_at(box({0, 0, 0.1}, {0.05, 0.05, 0}), 500, 10);
  sim::Simulation simulation(scene_with(source), {});
  for (int frame = 0; frame <= 90; ++frame) {
    simulation.advance_to(frame * kFrame_s, silhouettes);
    EXPECT_EQ(deepest_m(silhouettes, simulation.particles(0)), 0);
  }
  int at_rest = 0;
  const sim::ParticleSet& particles = simulation.particles(0);
  for (std::size_t i = 0; i < particles.size(); ++i) {
    if (particles.age_s[i] < 2) continue;
    ++at_rest;
    EXPECT_NEAR(particles.p_world_m[i].z(), source.radius_m, 0.001);
    EXPECT_LT(particles.v_world_m_s[i].norm(), 0.02);
  }
  EXPECT_GT(at_rest, 400);
  EXPECT_EQ(simulation.counters().particles.stuck, 0u);
  const std::uint64_t before = simulation.counters().particles.contacts;
  simulation.advance_to(90 * kFrame_s + kStep_s);
  const std::optional<sim::ParticleMetrics> metrics = simulation.metrics().particles;
  ASSERT_TRUE(metrics);
  EXPECT_EQ(metrics->particles, simulation.particles(0).size());
  EXPECT_EQ(metrics->hull_contacts, simulation.counters().particles.contacts - before)
      << "of one step";
  EXPECT_GT(metrics->hull_contacts, 400u);
  simulation.reset();
  EXPECT_EQ(simulation.metrics().particles->particles, 0u);
  EXPECT_EQ(simulation.metrics().particles->hull_contacts, 0u);
}

// One more camera looks away.
TEST(Particles, RestOnARealBlockIfTheCamerasThatSeeItLimitTheHull) {
  auto silhouettes = real_block();
  config::SimConfig config;
  config.hull_rule = {hull::Limits::seen, int(silhouettes.size())};
  silhouettes.push_back({{geometry::pinhole_from_fov(64, 48, 0.8),
                          geometry::look_at({0, 0, 1}, {0.1, 0, 2}, Vector3d::UnitX())},
                         hull::ObjectPixels(64, 48)});
  sim::Simulation simulation(scene_with(source_at(box({0, 0, 0.1}, {0.05, 0.05, 0}), 500, 10)),
                             config);
  for (int frame = 0; frame <= 45; ++frame) simulation.advance_to(frame * kFrame_s, silhouettes);
  EXPECT_GT(simulation.counters().particles.contacts, 1000u);
  EXPECT_EQ(simulation.counters().particles.stuck, 0u);
  for (const Vector3d& p_m : simulation.particles(0).p_world_m) EXPECT_GT(p_m.z(), 0);
}

TEST(Particles, FallThroughTheHullOutsideTheRigsVolume) {
  const auto silhouettes = real_block();
  config::SimConfig config;
  config.hull_rule.within_world_m = {Vector3d(-1, -1, -1), Vector3d(0, 1, 1)};
  sim::Simulation simulation(scene_with(source_at(box({0.03, 0, 0.1}, {0.02, 0.05, 0}), 500, 10)),
                             config);
  for (int frame = 0; frame <= 30; ++frame) simulation.advance_to(frame * kFrame_s, silhouettes);
  EXPECT_EQ(simulation.counters().particles.contacts, 0u);
}

// An arm, 6 cm thick, that crosses a rain of particles at 1 m/s.
std::vector<hull::Silhouette> arm_at(double x_m) {
  return silhouettes_of({{{x_m, -0.3, 0}, {x_m, 0.1, 0}, 0.03}}, ring(5, 1.5, 0.35, 300, 0.6));
}

TEST(Particles, NoneEndsAFrameInAHandAt1MPerS) {
  constexpr double kLifetime_s = 0.4;
  const config::ParticleSource source =
      source_at(box({0, 0, 0.12}, {0.15, 0.1, 0}), 3000, kLifetime_s);
  for (const bool with_history : {false, true}) {
    config::Scene scene = scene_with(source);
    if (with_history) scene.history.emplace();
    sim::Simulation simulation(scene, {}, box({0, 0, 0}, {0.3, 0.3, 0.2}));
    double worst_m = 0, fastest_m_s = 0;
    std::vector<hull::Silhouette> silhouettes;
    for (int frame = 0; frame < 40; ++frame) {
      const double t_s = frame * kFrame_s, way_m = std::fmod(t_s, 0.4);
      silhouettes = arm_at(way_m < 0.2 ? way_m - 0.1 : 0.3 - way_m);
      simulation.advance_to(t_s, silhouettes);
      worst_m = std::max(worst_m, deepest_m(silhouettes, simulation.particles(0)));
      for (const Vector3d& v_m_s : simulation.particles(0).v_world_m_s)
        fastest_m_s = std::max(fastest_m_s, v_m_s.norm());
    }
    const sim::ParticleCounters counters = simulation.counters().particles;
    std::printf("%s: deepest %.2f mm, fastest %.2f m/s, %llu contacts, %llu stuck\n",
                with_history ? "history" : "held hull", 1e3 * worst_m, fastest_m_s,
                static_cast<unsigned long long>(counters.contacts),
                static_cast<unsigned long long>(counters.stuck));
    EXPECT_LT(worst_m, 0.001);
    EXPECT_EQ(counters.stuck, 0u);
    EXPECT_GT(counters.contacts, 1000u);
    // A bounce off the hand at 1 m/s, and the fall.
    EXPECT_LT(fastest_m_s, 1.3 + kGravity_m_s2 * kLifetime_s);
  }
}

// With history, the hand throws them; held, it only moves them out of its way.
TEST(Particles, AHandPushesParticlesAtItsSpeedWithHistory) {
  for (const bool with_history : {false, true}) {
    config::ParticleSource source = source_at(box({0.02, 0, 0}, {0, 0.02, 0}), 2000, 10);
    source.restitution = 0;
    source.friction = 2;  // they do not slide around the hand
    config::Scene scene = scene_with(source);
    scene.gravity_m_s2 = 0;
    if (with_history) scene.history.emplace();
    sim::Simulation simulation(scene, {}, box({0, 0, 0}, {0.3, 0.3, 0.2}));
    std::vector<hull::Silhouette> silhouettes;
    for (int frame = 0; frame < 16; ++frame) {
      silhouettes = arm_at(-0.15 + 0.5 * frame * kFrame_s);
      simulation.advance_to(frame * kFrame_s, silhouettes);
    }
    double mean_m_s = 0;
    const sim::ParticleSet& particles = simulation.particles(0);
    int pushed = 0;
    for (std::size_t i = 0; i < particles.size(); ++i)
      // Only the particles that started before the hand arrived.
      if (particles.age_s[i] > 0.35) ++pushed, mean_m_s += particles.v_world_m_s[i].x();
    ASSERT_GT(pushed, 100);
    mean_m_s /= pushed;
    if (with_history) {
      EXPECT_NEAR(mean_m_s, 0.5, 0.05);
    } else {
      EXPECT_LT(mean_m_s, 0.01);
    }
  }
}

TEST(Particles, InWhichAHullAppearsLeaveItOrAreRemoved) {
  config::ParticleSource source = source_at(box({0, 0, 0}, {0.15, 0.15, 0.15}), 20000, 10);
  config::Scene scene = scene_with(source);
  scene.gravity_m_s2 = 0;
  sim::Simulation simulation(scene, {});
  simulation.advance_to(0);
  simulation.advance_to(0.1);
  const std::size_t before = simulation.particles(0).size();
  const auto silhouettes =
      silhouettes_of({{{0, 0, 0}, {0, 0, 0}, 0.14}}, ring(5, 1.5, 0.35, 300, 0.6));
  simulation.advance_to(0.1 + kFrame_s, silhouettes);
  EXPECT_EQ(deepest_m(silhouettes, simulation.particles(0)), 0);
  const std::uint64_t stuck = simulation.counters().particles.stuck;
  EXPECT_GT(stuck, 0u);
  EXPECT_GE(simulation.particles(0).size() + stuck, before);
  for (const Vector3d& v_m_s : simulation.particles(0).v_world_m_s) EXPECT_EQ(v_m_s.norm(), 0);
}

TEST(Particles, ResetBeginsAgainAndPauseHoldsThem) {
  const config::ParticleSource source = source_at(box({0, 0, 1}, {0.1, 0.1, 0}), 1000, 1);
  sim::Simulation simulation(scene_with(source), {});
  simulation.advance_to(0);
  simulation.advance_to(0.2);
  const std::vector<Vector3d> first_m = simulation.particles(0).p_world_m;
  simulation.pause();
  simulation.advance_to(5);
  EXPECT_EQ(simulation.particles(0).p_world_m, first_m);
  simulation.resume();
  simulation.reset();
  EXPECT_EQ(simulation.particles(0).size(), 0u);
  simulation.advance_to(5.2);
  EXPECT_EQ(simulation.particles(0).p_world_m, first_m);
}

TEST(Particles, DoNotDependOnTheNumberOfThreads) {
  config::ParticleSource source = source_at(box({0, 0, 0.12}, {0.15, 0.1, 0}), 3000, 1);
  source.spread_m_s = 0.3;
  std::vector<std::vector<Vector3d>> results;
  for (const int threads : {1, 3}) {
    sim::Simulation simulation(scene_with(source), {.threads = threads});
    std::vector<hull::Silhouette> silhouettes;
    for (int frame = 0; frame < 12; ++frame) {
      silhouettes = arm_at(-0.1 + frame * 0.02);
      simulation.advance_to(frame * kFrame_s, silhouettes);
    }
    results.push_back(simulation.particles(0).p_world_m);
  }
  EXPECT_EQ(results[0], results[1]);
  EXPECT_GT(results[0].size(), 500u);
}

TEST(Particles, ThatLeaveTheSceneVanish) {
  config::ParticleSource source = source_at(box({0, 0, 0}, {0.1, 0.1, 0}), 100, 100);
  source.velocity_world_m_s = {50, 0, 0};
  sim::Simulation simulation(scene_with(source), {});
  for (int i = 0; i <= 10; ++i) simulation.advance_to(0.1 * i);
  EXPECT_LT(simulation.particles(0).size(), 10u);
  EXPECT_EQ(simulation.counters().particles.not_finite, 0u);
}

}  // namespace
}  // namespace fivepipe::test
