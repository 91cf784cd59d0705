// Contact of a cloth with the hull: the paper's curtain (section 4.5).
#include <gtest/gtest.h>

#include <algorithm>

#include "common/hull/oracle/analytic.h"
#include "sim_node/simulation/simulation.h"
#include "tests/support/sim_scene.h"

namespace fivepipe::sim {
namespace {

using Eigen::Vector3d;

constexpr double kPixel_m = 0.002;  // of test::seen()

config::SceneObject panel(const std::string& name, double x_m, const Vector3d& v_rec) {
  config::SceneObject object{.name = name,
                             .shape = config::CurtainShape{0.32, 0.5, 10, 18, 0.012, 3},
                             .world_from_object = test::at({x_m, 0, 0.25}),
                             .motion = config::Motion::cloth,
                             .reaction = config::Reaction::yield,
                             .cloth = config::ClothSettings{}};
  object.cloth->v_rec_world = v_rec;
  object.cloth->pins = {{{Vector3d(-1, -1, -1e-6), Vector3d(1, 1, 1e-6)}, Vector3d(1, 0, 0)}};
  return object;
}

// Four fingers, 2 cm thick, that point along +y, and the arm behind them.
std::vector<hull::Capsule> hand(double x_m, double y_m, double outward) {
  std::vector<hull::Capsule> parts;
  for (const double z_m : {-0.033, -0.011, 0.011, 0.033})
    parts.push_back({{x_m, y_m - 0.09, z_m}, {x_m, y_m, z_m}, 0.01});
  parts.push_back({{x_m, y_m - 0.16, 0}, {x_m, y_m - 0.10, 0}, 0.03});
  parts.push_back({{x_m, y_m - 0.16, 0}, {x_m + 0.1 * outward, y_m - 0.30, -0.03}, 0.033});
  return parts;
}

// Two hands reach in between the panels, and part them at up to speed_m_s.
std::vector<hull::Capsule> parting_hands(double t_s, double speed_m_s) {
  constexpr double kReach_s = 0.6, kWay_m = 0.15;
  const double y_m = std::min(0.05, -0.1 + 0.3 * t_s),
               turn = std::clamp((t_s - kReach_s) * 2 * speed_m_s / kWay_m, 0.0, M_PI),
               x_m = 0.017 + 0.5 * kWay_m * (1 - std::cos(turn));
  std::vector<hull::Capsule> parts = hand(x_m, y_m, 1);
  for (const hull::Capsule& left : hand(-x_m, y_m, -1)) parts.push_back(left);
  return parts;
}

std::vector<hull::Silhouette> seen_by_three(const std::vector<hull::Capsule>& real) {
  return test::silhouettes_of(real, test::ring(3, 1.5, 0.5, 350, 0.7));
}

// How far the hull reaches beyond a point of the cloth along V_rec: the definition of hull.h, on
// points 0.2 mm apart.
double behind_m(const std::vector<hull::Silhouette>& silhouettes, const Vector3d& p_m,
                const Vector3d& v_rec) {
  double behind_m = 0;
  while (hull::in_hull(silhouettes, p_m + behind_m * v_rec)) behind_m += 0.2e-3;
  return behind_m;
}

// The largest behind_m(p_world_m) over points of the cloth's triangles that are at most 2.5 mm
// apart.
template <class BehindM>
double deepest_behind_m(const std::vector<Vector3d>& vertices_world_m, const geometry::Mesh& mesh,
                        const BehindM& behind_m) {
  double deepest_m = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    constexpr int kParts = 16;  // the triangles' sides are up to 4 cm
    for (int i = 0; i <= kParts; ++i)
      for (int j = 0; i + j <= kParts; ++j) {
        const double s = double(i) / kParts, t = double(j) / kParts;
        const Vector3d p =
            (1 - s - t) * vertices_world_m[a] + s * vertices_world_m[b] + t * vertices_world_m[c];
        deepest_m = std::max(deepest_m, behind_m(p));
      }
  }
  return deepest_m;
}

double deepest_behind_m(const ObjectState& state, const geometry::Mesh& mesh,
                        const std::vector<hull::Silhouette>& silhouettes, const Vector3d& v_rec) {
  std::vector<Vector3d> vertices_world_m;
  for (const Vector3d& p : state.vertices_m)
    vertices_world_m.push_back(state.world_from_object * p);
  return deepest_behind_m(vertices_world_m, mesh, [&](const Vector3d& p_world_m) {
    return behind_m(silhouettes, p_world_m, v_rec);
  });
}

config::Scene two_panels() {
  return test::scene_of({panel("left", -0.165, {-1, 0, 0}), panel("right", 0.165, {1, 0, 0})});
}

struct Parting {
  std::vector<double> deepest_m;  // per frame, over both panels
  double fastest_m_s = 0;         // largest change of a vertex's place between two frames, per time
};

Parting part(double speed_m_s) {
  const config::Scene scene = two_panels();
  Simulation simulation(scene, {});
  Parting result;
  std::vector<ObjectState> before;
  for (int frame = 0; frame < 60; ++frame) {
    const double t_s = frame * test::kFrame_s;
    const std::vector<hull::Silhouette> silhouettes = seen_by_three(parting_hands(t_s, speed_m_s));
    simulation.advance_to(t_s, silhouettes);
    const std::vector<ObjectState> states = simulation.states();
    double deepest_m = 0;
    for (std::size_t i = 0; i < states.size(); ++i) {
      deepest_m =
          std::max(deepest_m, deepest_behind_m(states[i], config::mesh_of(scene.objects[i]),
                                               silhouettes, *scene.objects[i].cloth->v_rec_world));
      for (std::size_t v = 0; v < states[i].vertices_m.size() && !before.empty(); ++v)
        result.fastest_m_s =
            std::max(result.fastest_m_s,
                     (states[i].vertices_m[v] - before[i].vertices_m[v]).norm() / test::kFrame_s);
    }
    result.deepest_m.push_back(deepest_m);
    before = states;
  }
  std::sort(result.deepest_m.begin(), result.deepest_m.end());
  return result;
}

TEST(ClothInHull, HandsPartTheCurtainAndStayBeforeIt) {
  for (const double speed_m_s : {0.3, 1.0}) {
    const Parting parting = part(speed_m_s);
    const double worst_m = parting.deepest_m.back();
    std::printf(
        "hands at %.1f m/s: deepest behind the cloth p50 %.2f, worst of 60 frames %.2f mm; fastest "
        "%.2f m/s\n",
        speed_m_s, 1e3 * parting.deepest_m[parting.deepest_m.size() / 2], 1e3 * worst_m,
        parting.fastest_m_s);
    EXPECT_LT(worst_m, 2e-3) << speed_m_s << " m/s";
    // 1.5 times the hand, and a fall by half the panel's height.
    EXPECT_LT(parting.fastest_m_s, 1.5 * speed_m_s + std::sqrt(2 * 9.80665 * 0.25))
        << speed_m_s << " m/s";
  }
}

// The limit on the speed follows the hull, so that it does not hold back what the hands drag along.
TEST(ClothInHull, WithoutGravityTheClothFollowsTheHands) {
  config::Scene scene = two_panels();
  scene.gravity_m_s2 = 0;
  ClothObjects cloths(scene);
  CurrentHull hull(scene, {}, true, {});
  constexpr int kSteps = 8;
  constexpr double kSpeed_m_s = 1.0;
  double fastest_m_s = 0;
  std::vector<hull::Silhouette> silhouettes;
  for (int frame = 0; frame < 30; ++frame) {
    silhouettes = seen_by_three(parting_hands(frame * test::kFrame_s, kSpeed_m_s));
    hull.set(frame * test::kFrame_s, silhouettes);
    for (int left = kSteps; left > 0; --left) {
      cloths.step(test::kFrame_s / kSteps, std::uint64_t(left), hull, 0);
      for (const Vector3d& v : cloths.cloth(0).velocities_world_m_s())
        fastest_m_s = std::max(fastest_m_s, v.norm());
    }
  }
  EXPECT_GT(fastest_m_s, 0.5 * kSpeed_m_s);
  EXPECT_LT(fastest_m_s, 1.5 * kSpeed_m_s);
}

// With a history the hull moves between frames: after each step, no part of it is more than 2 mm
// behind the cloth where it is then.
TEST(ClothInHull, WithHistoryTheClothStaysBeforeTheHandsInEachStep) {
  for (const double speed_m_s : {0.3, 1.0}) {
    config::Scene scene = two_panels();
    scene.history.emplace();
    ClothObjects cloths(scene);
    CurrentHull hull(scene, {}, true, {Vector3d(-0.45, -0.35, -0.15), Vector3d(0.45, 0.15, 0.15)});
    constexpr int kSteps = 8;
    constexpr double kStep_s = test::kFrame_s / kSteps;
    std::vector<double> deepest_m;
    std::vector<hull::Silhouette> silhouettes;
    double fastest_m_s = 0;
    for (int frame = 0; frame < 36; ++frame) {
      silhouettes = seen_by_three(parting_hands(frame * test::kFrame_s, speed_m_s));
      hull.set(frame * test::kFrame_s, silhouettes);
      for (int left = kSteps; left > 0; --left) {
        const double before_s = (left - 1) * kStep_s;
        cloths.step(kStep_s, std::uint64_t(left), hull, before_s);
        double step_deepest_m = 0;
        for (std::size_t i = 0; i < 2; ++i) {
          const std::vector<Vector3d>& vertices_m = cloths.cloth(i).vertices_world_m();
          for (const Vector3d& v : cloths.cloth(i).velocities_world_m_s())
            fastest_m_s = std::max(fastest_m_s, v.norm());
          for (const HullPart& part : hull.parts()) {
            const Eigen::Isometry3d newest = newest_from_before(part, before_s);
            const Vector3d v_rec = newest.linear() * *scene.objects[i].cloth->v_rec_world;
            step_deepest_m =
                std::max(step_deepest_m,
                         deepest_behind_m(vertices_m, config::mesh_of(scene.objects[i]),
                                          [&](const Vector3d& p_m) {
                                            return part.box_world_m.contains(newest * p_m)
                                                       ? behind_m(silhouettes, newest * p_m, v_rec)
                                                       : 0;
                                          }));
          }
        }
        deepest_m.push_back(step_deepest_m);
      }
    }
    std::sort(deepest_m.begin(), deepest_m.end());
    std::printf(
        "history, hands at %.1f m/s: deepest behind the cloth in a step p99 %.2f, worst %.2f "
        "mm; fastest %.2f m/s\n",
        speed_m_s, 1e3 * deepest_m[deepest_m.size() * 99 / 100], 1e3 * deepest_m.back(),
        fastest_m_s);
    EXPECT_LT(deepest_m[deepest_m.size() * 99 / 100], 2e-3) << speed_m_s << " m/s";
    EXPECT_LT(fastest_m_s, 1.5 * speed_m_s + std::sqrt(2 * 9.80665 * 0.25)) << speed_m_s;
    EXPECT_GT(cloths.counters().contacts, 100u);
  }
}

TEST(ClothInHull, TheCurtainOpens) {
  const config::Scene scene = two_panels();
  Simulation simulation(scene, {});
  std::vector<hull::Silhouette> silhouettes;
  for (int frame = 0; frame < 60; ++frame) {
    silhouettes = seen_by_three(parting_hands(frame * test::kFrame_s, 0.5));
    simulation.advance_to(frame * test::kFrame_s, silhouettes);
  }
  // At the height of the hands, the gap between the panels is as wide as the hands are apart.
  double left_m = -1, right_m = 1;
  std::array<int, 2> seen = {0, 0};
  const std::vector<ObjectState> states = simulation.states();
  for (std::size_t i = 0; i < 2; ++i)
    for (const Vector3d& v : states[i].vertices_m) {
      const Vector3d p = states[i].world_from_object * v;
      if (std::abs(p.z()) > 0.03) continue;
      ++seen[i];
      if (i == 0) left_m = std::max(left_m, p.x());
      if (i == 1) right_m = std::min(right_m, p.x());
    }
  EXPECT_GT(std::min(seen[0], seen[1]), 10);
  EXPECT_LT(left_m, -0.15);
  EXPECT_GT(right_m, 0.15);
}

TEST(ClothInHull, WithoutReactionTheHandsPassThrough) {
  config::Scene scene = two_panels();
  for (config::SceneObject& object : scene.objects) object.reaction = config::Reaction::none;
  Simulation simulation(scene, {}), alone(scene, {});
  for (int frame = 0; frame < 40; ++frame) {
    const double t_s = frame * test::kFrame_s;
    const auto silhouettes = seen_by_three(parting_hands(t_s, 1));
    simulation.advance_to(t_s, silhouettes);
    alone.advance_to(t_s);
  }
  for (std::size_t i = 0; i < 2; ++i)
    EXPECT_EQ(simulation.states()[i].vertices_m, alone.states()[i].vertices_m);
}

// A sheet without V_rec falls on a ball and stays there.
TEST(ClothInHull, ASheetLiesOnABall) {
  config::SceneObject sheet{.name = "sheet",
                            .shape = config::CurtainShape{0.3, 0.3, 14, 14, 0, 0},
                            .world_from_object = test::at({0, 0.15, 0.14}) *
                                                 Eigen::AngleAxisd(-0.5 * M_PI, Vector3d::UnitX()),
                            .motion = config::Motion::cloth,
                            .reaction = config::Reaction::yield,
                            .cloth = config::ClothSettings{.friction = 0.8}};
  const config::Scene scene = test::scene_of({sheet});
  Simulation simulation(scene, {});
  const auto silhouettes = test::seen({test::ball({0, 0, 0}, 0.1)});
  for (int frame = 0; frame < 150; ++frame)
    simulation.advance_to(frame * test::kFrame_s, silhouettes);
  const ObjectState state = simulation.states()[0];
  double highest_m = -1;
  for (const Vector3d& v : state.vertices_m)
    highest_m = std::max(highest_m, (state.world_from_object * v).z());
  // The hull of five cameras is higher than the ball by less than a pixel's diagonal.
  EXPECT_GT(highest_m, 0.1);
  EXPECT_LT(highest_m, 0.1 + scene.objects[0].cloth->thickness_m + 5 * kPixel_m);
}

TEST(ClothInHull, AHullThatAppearsInsideIsLeftWithinAFrame) {
  const config::Scene scene = two_panels();
  Simulation simulation(scene, {});
  const auto nothing = seen_by_three({});
  simulation.advance_to(0, nothing);
  simulation.advance_to(test::kFrame_s, nothing);
  const auto block = seen_by_three({test::ball({0.1, 0, -0.05}, 0.05)});
  simulation.advance_to(2 * test::kFrame_s, block);
  EXPECT_LT(
      deepest_behind_m(simulation.states()[1], config::mesh_of(scene.objects[1]), block, {1, 0, 0}),
      2e-3);
  EXPECT_GT(simulation.counters().cloth.contacts, 0u);
  const std::optional<ClothMetrics> metrics = simulation.metrics().cloths;
  ASSERT_TRUE(metrics);
  EXPECT_EQ(metrics->cloths, 2u);
  EXPECT_GT(metrics->hull.count, 0u);
  EXPECT_LE(metrics->hull.deepest_m, kClothIndifferent_m);
  simulation.reset();
  EXPECT_EQ(simulation.metrics().cloths->hull.count, 0u);
}

// The upper edge cannot leave the hull: the contacts there move nothing, and the search ends.
TEST(ClothInHull, AHandOnTheRailIsCountedAndHarmsNothing) {
  config::Scene scene = two_panels();
  for (config::SceneObject& object : scene.objects) object.cloth->pins[0].slides_along.reset();
  Simulation simulation(scene, {});
  const auto hand_on_rail = seen_by_three({test::ball({0.15, 0, 0.25}, 0.03)});
  for (int frame = 0; frame < 10; ++frame)
    simulation.advance_to(frame * test::kFrame_s, hand_on_rail);
  EXPECT_GT(simulation.counters().cloth.still_colliding, 0u);
  EXPECT_EQ(simulation.counters().cloth.reset, 0u);
  const std::vector<ObjectState> states = simulation.states();
  for (const Vector3d& v : states[1].vertices_m) EXPECT_TRUE(v.allFinite());
  // The definition of the hull gives the same depth, from the cloth without its thickness. Of a
  // triangle at most eight points are followed, so the deepest one may be missed.
  const double behind_m =
      deepest_behind_m(states[1], config::mesh_of(scene.objects[1]), hand_on_rail, {1, 0, 0});
  const double deepest_m = simulation.metrics().cloths->hull.deepest_m;
  EXPECT_GT(behind_m, 0.02);
  EXPECT_GT(deepest_m, 0.8 * behind_m);
  EXPECT_LT(deepest_m, behind_m + scene.objects[1].cloth->thickness_m + 1e-3);
}

TEST(ClothInHull, PauseAndResetHoldForCloth) {
  Simulation simulation(two_panels(), {});
  const std::vector<Vector3d> start = simulation.states()[0].vertices_m;
  for (int frame = 0; frame < 30; ++frame) simulation.advance_to(frame * test::kFrame_s);
  const std::vector<Vector3d> moved = simulation.states()[0].vertices_m;
  EXPECT_NE(moved, start);
  simulation.pause();
  simulation.advance_to(11);  // ten seconds are not simulated
  simulation.resume();
  EXPECT_EQ(simulation.states()[0].vertices_m, moved);
  simulation.reset();
  EXPECT_EQ(simulation.states()[0].vertices_m, start);
}

TEST(ClothInHull, ResultsAreTheSameBitsWithAnyNumberOfThreads) {
  Simulation one(two_panels(), {.threads = 1}), three(two_panels(), {.threads = 3});
  for (int frame = 0; frame < 36; ++frame) {
    const double t_s = frame * test::kFrame_s;
    const auto silhouettes = seen_by_three(parting_hands(t_s, 1));
    one.advance_to(t_s, silhouettes);
    three.advance_to(t_s, silhouettes);
  }
  for (std::size_t i = 0; i < 2; ++i)
    EXPECT_EQ(one.states()[i].vertices_m, three.states()[i].vertices_m);
}

TEST(ClothInHull, AReactingClothIsReportedWithItsPresentShape) {
  config::Scene scene = two_panels();
  for (config::SceneObject& object : scene.objects) {
    object.reaction = config::Reaction::highlight;
    object.requests.triangles = true;
  }
  Simulation simulation(scene, {});
  // The panels have fallen free of the ball, which is where they were at the start.
  for (config::SceneObject& object : scene.objects) object.cloth->pins.clear();
  Simulation fallen(scene, {});
  const auto ball = seen_by_three({test::ball({0.1, 0, 0.1}, 0.03)});
  for (int frame = 0; frame < 20; ++frame) {
    simulation.advance_to(frame * test::kFrame_s, ball);
    fallen.advance_to(frame * test::kFrame_s, ball);
  }
  EXPECT_TRUE(simulation.collisions()[1].collision.colliding());
  EXPECT_FALSE(fallen.collisions()[1].collision.colliding());
}

TEST(ClothInHull, ALostClothReturnsToItsStart) {
  config::Scene scene = two_panels();
  for (config::SceneObject& object : scene.objects) object.cloth->pins.clear();
  Simulation simulation(scene, {});
  for (int frame = 0; frame < 90; ++frame) simulation.advance_to(frame * test::kFrame_s);
  EXPECT_GT(simulation.counters().cloth.reset, 0u);
  const std::vector<ObjectState> states = simulation.states();
  for (const Vector3d& v : states[0].vertices_m) EXPECT_LT(v.norm(), 5.0);
}

}  // namespace
}  // namespace fivepipe::sim
