// Rigid bodies in contact with the hull (reaction contact): bounces, rest, stacks, pushes, throws.
#include <algorithm>
#include <numeric>

#include "tests/support/hull/tangent_cones.h"
#include "tests/support/sanitizer.h"
#include "tests/support/sim_contact.h"

namespace fivepipe::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

// Each pixel at the silhouettes' borders belongs to the object with probability 1/2.
class Noise {
 public:
  explicit Noise(std::vector<hull::Silhouette> silhouettes) : clean_(std::move(silhouettes)) {
    for (const hull::Silhouette& silhouette : clean_) {
      auto& border = borders_.emplace_back();
      const hull::ObjectPixels& pixels = silhouette.pixels;
      for (int v = 0; v < pixels.height_px(); ++v)
        for (int u = 0; u < pixels.width_px(); ++u)
          if (!pixels.contains(u, v) && (pixels.contains(u - 1, v) || pixels.contains(u + 1, v) ||
                                         pixels.contains(u, v - 1) || pixels.contains(u, v + 1)))
            border.emplace_back(u, v);
    }
  }
  std::vector<hull::Silhouette> next(Random& random) const {
    std::vector<hull::Silhouette> noisy = clean_;
    for (std::size_t i = 0; i < noisy.size(); ++i)
      for (const auto& [u, v] : borders_[i])
        if (random() % 2 == 0) noisy[i].pixels.set(u, v);
    return noisy;
  }

 private:
  std::vector<hull::Silhouette> clean_;
  std::vector<std::vector<std::pair<int, int>>> borders_;
};

TEST(HullContact, ABallComesToRestOnARealBlock) {
  const auto silhouettes = real_block();
  sim::Simulation simulation(scene_of({touching_ball({0.01, 0.02, 0.15}, 0.04, 0.5, 0.5)}), {});
  for (int frame = 0; frame <= 120; ++frame) simulation.advance_to(frame * kFrame_s, silhouettes);
  EXPECT_LT((center_m(simulation) - Vector3d(0.01, 0.02, 0.04)).norm(), 0.001)
      << center_m(simulation).transpose();
  EXPECT_LT(velocity_m_s(simulation).norm(), 1e-3);
  EXPECT_GT(simulation.counters().impacts, 1u);
}

// The hull appears 10 mm deep in the lower part of the ball. It leaves within a quarter of a
// second, and not by a jump.
TEST(HullContact, ABallInWhichTheHullAppearsLeavesItSlowly) {
  const auto silhouettes = real_block();
  sim::Simulation simulation(scene_of({touching_ball({0.01, 0.02, 0.03}, 0.04, 0.5, 0.5)}), {});
  double fastest_m_s = 0;
  for (int step = 0; step <= 60; ++step) {
    if (step == 0)
      simulation.advance_to(0, silhouettes);
    else
      simulation.advance_to(step * kStep_s);
    fastest_m_s = std::max(fastest_m_s, velocity_m_s(simulation).norm());
  }
  EXPECT_NEAR(center_m(simulation).z(), 0.04, 0.002);
  EXPECT_LT(fastest_m_s, 2 * kGravity_m_s2 * kStep_s);
}

// The kinetic and potential energy at the top of a bounce.
TEST(HullContact, AnElasticBallNeverGainsEnergyIn1000Bounces) {
  const auto silhouettes = real_block();
  const double start_m = 0.1;
  sim::Simulation simulation(scene_of({touching_ball({0.003, 0.002, start_m}, 0.04, 1)}), {});
  simulation.advance_to(0, silhouettes);
  int bounces = 0, step = 0;
  double highest_m = 0, previous_m_s = 0;
  const double start_J_kg = kGravity_m_s2 * (start_m - 0.04);
  while (bounces < 1000 && step < 240 * 600) {
    simulation.advance_to(++step * kStep_s);
    const double v = velocity_m_s(simulation).z();
    bounces += previous_m_s < 0 && v > 0;
    previous_m_s = v;
    highest_m = std::max(highest_m, center_m(simulation).z());
  }
  EXPECT_EQ(bounces, 1000);
  EXPECT_LE(kGravity_m_s2 * (highest_m - 0.04), 1.001 * start_J_kg);
  const double now_J_kg = 0.5 * velocity_m_s(simulation).squaredNorm() +
                          kGravity_m_s2 * (center_m(simulation).z() - 0.04);
  EXPECT_GT(now_J_kg, 0.5 * start_J_kg);
  std::printf("energy after %d bounces: %.3f of the start's; highest %.5f\n", bounces,
              now_J_kg / start_J_kg, (highest_m - 0.04) / (start_m - 0.04));
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

// The outline of the real ball has a radius of 25 px. Balls without friction and gravity fly at it
// from all sides.
TEST(HullContact, ABallIsReflectedAtTheHull) {
  Random random(3);
  std::vector<geometry::Camera> cameras = ring(6, 1.5, 0.3, 300, 0.6);
  for (const geometry::Camera& camera : ring(3, 1.5, -0.5, 300, 0.6)) cameras.push_back(camera);
  const TangentCones real{cameras, Vector3d(0.004, -0.003, 0.002), 0.05};
  const auto silhouettes = silhouettes_of({ball(real.center_m, real.radius_m)}, cameras);
  std::vector<double> to_hull_deg, to_ball_deg, hull_to_ball_deg;
  const int count = 100 / kSlowdown;
  for (int i = 0; i < count; ++i) {
    const double radius_m = 0.03;
    const Vector3d from = random_direction(random),
                   side = from.cross(random_direction(random)).normalized();
    const double off_m = uniform(random, 0, 0.7) * (real.radius_m + radius_m);
    const Vector3d start_m = real.center_m + 0.15 * from + off_m * side,
                   before_m_s = -uniform(random, 0.5, 3) * from;
    config::Scene scene = scene_of({touching_ball(start_m, radius_m, 1)});
    scene.gravity_m_s2 = 0;
    scene.objects[0].velocity_world_m_s = before_m_s;
    sim::Simulation simulation(scene, {});
    double time_s = 0;
    simulation.advance_to(0, silhouettes);
    while (simulation.counters().impacts == 0 && time_s < 0.5)
      simulation.advance_to(time_s += kStep_s);
    simulation.advance_to(time_s += kStep_s);
    if (simulation.counters().impacts == 0) continue;
    // Where the ball first touches the analytic hull.
    double free = 0, inside = 0.15 / before_m_s.norm();
    const auto gap_m = [&](double t_s) {
      const Vector3d c = start_m + t_s * before_m_s;
      return (real.nearest(c) - c).norm() - radius_m;
    };
    if (gap_m(inside) > 0) continue;
    for (int k = 0; k < 40; ++k) {
      const double t = 0.5 * (free + inside);
      (gap_m(t) > 0 ? free : inside) = t;
    }
    const Vector3d touch_m = start_m + free * before_m_s,
                   normal = (touch_m - real.nearest(touch_m)).normalized(),
                   expected = before_m_s - 2 * before_m_s.dot(normal) * normal;
    to_hull_deg.push_back(between_deg(velocity_m_s(simulation), expected));
    const Vector3d true_normal = (touch_m - real.center_m).normalized();
    const Vector3d at_ball = before_m_s - 2 * before_m_s.dot(true_normal) * true_normal;
    to_ball_deg.push_back(between_deg(velocity_m_s(simulation), at_ball));
    hull_to_ball_deg.push_back(between_deg(expected, at_ball));
    EXPECT_NEAR(velocity_m_s(simulation).norm(), before_m_s.norm(), 1e-6 * before_m_s.norm());
  }
  ASSERT_GT(double(to_hull_deg.size()), 0.6 * count);
  std::printf(
      "deviation from the reflection at the analytic hull: median %.2f deg; at the real ball: %.2f "
      "deg, of which the analytic hull's own: %.2f deg (%zu bounces)\n",
      median(to_hull_deg), median(to_ball_deg), median(hull_to_ball_deg), to_hull_deg.size());
  EXPECT_LT(median(to_hull_deg), 3);
  // The hull of nine silhouettes has facets: the reflection at it differs as much from that at the
  // ball.
  EXPECT_NEAR(median(to_ball_deg), median(hull_to_ball_deg), 1);
}

std::vector<config::SceneObject> stack(int count, double edge_m) {
  std::vector<config::SceneObject> blocks;
  for (int i = 0; i < count; ++i) {
    blocks.push_back(touching(virtual_box("block_" + std::to_string(i),
                                          {0.001 * i, -0.001 * i, (i + 0.5) * edge_m},
                                          {edge_m, edge_m, edge_m})));
    blocks.back().restitution = 0.1;
    blocks.back().mass_kg = 0.2;
  }
  return blocks;
}

TEST(HullContact, FiveBlocksStandOnARealBlockForAMinute) {
  const auto silhouettes = real_block();
  sim::Simulation simulation(scene_of(stack(5, 0.06)), {});
  std::vector<Vector3d> start_m;
  for (std::size_t i = 0; i < 5; ++i) start_m.push_back(center_m(simulation, i));
  for (int frame = 0; frame <= 60 * 30; ++frame)
    simulation.advance_to(frame * kFrame_s, silhouettes);
  for (std::size_t i = 0; i < 5; ++i) {
    const Vector3d moved_m = center_m(simulation, i) - start_m[i];
    std::printf("block %zu of five moves by %.2f mm, %.2f mm of it in z\n", i, 1e3 * moved_m.norm(),
                1e3 * moved_m.z());
    EXPECT_LT(std::abs(moved_m.z()), 0.002) << i;
    EXPECT_LT(moved_m.norm(), 0.005) << i;
  }
}

// The top of a real ball of 8 cm: the measured heights of a contact differ by more than a pixel.
TEST(HullContact, ABlockRestsOnTheTopOfARealBall) {
  const auto silhouettes = silhouettes_of({ball({0, 0, -0.08}, 0.08)}, ring(7, 1.5, 0, 300, 0.6));
  config::SceneObject block = touching(virtual_box("block", {0, 0, 0.03}, {0.04, 0.04, 0.04}));
  block.restitution = 0;
  sim::Simulation simulation(scene_of({block}), {});
  for (int frame = 0; frame <= 90; ++frame) simulation.advance_to(frame * kFrame_s, silhouettes);
  double top_m = 0;  // of the hull
  while (hull::in_hull(silhouettes, {0, 0, top_m})) top_m += 1e-5;
  const double above_m = center_m(simulation).z() - 0.02 - top_m;
  std::printf("a block on a ball: %.2f mm above the hull's top at %.2f mm\n", 1e3 * above_m,
              1e3 * top_m);
  EXPECT_LT(std::abs(above_m), 0.001) << "half a pixel's footprint";
  EXPECT_LT(velocity_m_s(simulation).norm(), 1e-3);
}

// Returns the largest distance of a block from its place after the first second [m].
double wander_m(double time_s, std::uint64_t seed) {
  Random random(seed);
  const Noise noise(real_block());
  sim::Simulation simulation(
      scene_of({touching(virtual_box("block", {0, 0, 0.035}, {0.06, 0.06, 0.06}))}), {});
  Vector3d place_m = Vector3d::Zero();
  double largest_m = 0;
  std::vector<hull::Silhouette> noisy;
  for (int frame = 0; frame <= time_s * 30; ++frame) {
    noisy = noise.next(random);
    simulation.advance_to(frame * kFrame_s, noisy);
    if (frame == 30) place_m = center_m(simulation);
    if (frame > 30) largest_m = std::max(largest_m, (center_m(simulation) - place_m).norm());
  }
  return largest_m;
}

TEST(HullContact, ABlockAtRestKeepsItsPlaceUnderPixelNoise) {
  const double time_s = std::getenv("FIVEPIPE_LONG") ? 3600 : 30, wander = wander_m(time_s, 2);
  std::printf("a block at rest moved by %.2f mm in %.0f s\n", 1e3 * wander, time_s);
  EXPECT_LT(wander, 0.002);
}

// A real tray carries the ball up and stops. The cameras are far away, so that the hull's top is
// nearly flat at every height.
TEST(HullContact, AThrownBallLeavesWithTheHandsVelocity) {
  for (const double speed_m_s : {0.5, 1.0, 2.0, 3.0}) {
    if (kHasSanitizer && speed_m_s < 3) continue;  // each takes more than a minute
    config::Scene scene = scene_of({touching_ball({0, 0, -0.2 + 0.03}, 0.03, 0, 0.5)});
    scene.history.emplace();
    sim::Simulation simulation(scene, {}, {Vector3d(-0.3, -0.3, -0.5), Vector3d(0.3, 0.3, 1.0)});
    const auto cameras = ring(5, 12, 0, 500, 1.2, {0, 0, 0.1});
    // It rests, accelerates within 0.2 s, keeps its speed for 0.1 s and stops.
    double z_m = -0.2;
    std::vector<hull::Silhouette> seen;
    double left_m_s = 0;
    for (int frame = 0; frame <= 30; ++frame) {
      const double t = (frame - 12) * kFrame_s;
      const double v = t <= 0 ? 0 : t < 0.2 ? speed_m_s * t / 0.2 : t < 0.3 ? speed_m_s : 0;
      z_m += v * kFrame_s;
      seen = silhouettes_of_box(
          Eigen::AlignedBox3d(Vector3d(-0.08, -0.08, z_m - 0.06), Vector3d(0.08, 0.08, z_m)),
          cameras);
      simulation.advance_to(frame * kFrame_s, seen);
      // It stops at the time of frame 20; the ball has fallen freely for a frame since then.
      if (frame == 21) left_m_s = velocity_m_s(simulation).z() + kGravity_m_s2 * kFrame_s;
    }
    std::printf("hand %.1f m/s: ball %.3f m/s\n", speed_m_s, left_m_s);
    EXPECT_NEAR(left_m_s, speed_m_s, 0.1 * speed_m_s) << speed_m_s;
  }
}

// A real pipe of 20 mm crosses virtual balls of 30 mm between two frames, at 6 m/s and 30 Hz: 20 cm
// per frame.
TEST(HullContact, AFastPipeStrikesEveryBall) {
  const int count = std::getenv("FIVEPIPE_LONG") ? 1000 : 20;
  Random random(6);
  const double speed_m_s = 6, pipe_m = 0.01, ball_m = 0.015;
  // The pipe's hull has 22 sides. With 8 cameras it has 8, because opposite cameras see the same,
  // and its own normals are up to 22 degrees off.
  const auto cameras = ring(11, 1.5, 0, 400, 0.9);
  std::vector<double> off_deg;
  int struck = 0;
  std::vector<std::vector<hull::Silhouette>> frames;
  for (int frame = 0; frame < 5; ++frame) {
    const double x_m = -0.5 + frame * speed_m_s * kFrame_s;
    frames.push_back(silhouettes_of({{{x_m, 0, -0.1}, {x_m, 0, 0.1}, pipe_m}}, cameras));
  }
  for (int i = 0; i < count; ++i) {
    const double off_m = uniform(random, -0.8, 0.8) * (pipe_m + ball_m);
    Vector3d start_m{uniform(random, -0.05, 0.15), off_m, uniform(random, -0.05, 0.05)};
    // The pipe reaches this ball where the hull of the next frame has a pixel more.
    if (i == 0) start_m = {0.0965, -0.0154, -0.0072};
    config::Scene scene = scene_of({touching_ball(start_m, ball_m, 0)});
    scene.gravity_m_s2 = 0;
    scene.history = config::HistoryRequests{.max_speed_m_s = 10};
    sim::Simulation simulation(scene, {}, {Vector3d(-0.6, -0.3, -0.3), Vector3d(0.6, 0.3, 0.3)});
    Vector3d after_m_s = Vector3d::Zero();
    for (int frame = 0; frame < 5; ++frame) {
      simulation.advance_to(frame * kFrame_s, frames[std::size_t(frame)]);
      if (after_m_s.norm() == 0) after_m_s = velocity_m_s(simulation);
    }
    if (after_m_s.norm() < 0.1) continue;
    ++struck;
    // Without friction, the ball leaves along the line of the centres.
    const Vector3d normal =
        Vector3d(std::sqrt(std::pow(pipe_m + ball_m, 2) - start_m.y() * start_m.y()), start_m.y(),
                 0)
            .normalized();
    off_deg.push_back(between_deg(after_m_s, normal));
  }
  std::sort(off_deg.begin(), off_deg.end());
  std::printf("struck %d of %d; direction: median %.1f, worst %.1f deg\n", struck, count,
              off_deg.empty() ? -1 : off_deg[off_deg.size() / 2],
              off_deg.empty() ? -1 : off_deg.back());
  EXPECT_EQ(struck, count);
  EXPECT_LT(off_deg.empty() ? 180 : off_deg.back(), 10);
}

}  // namespace
}  // namespace fivepipe::test
