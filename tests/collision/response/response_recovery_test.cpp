// recovery.h against the exact reference and in_hull() on random scenes; CP_obj by its definition.
#include <iostream>

#include "common/collision/response/hull_normal.h"
#include "common/collision/response/recovery.h"
#include "common/hull/oracle/reference.h"
#include "tests/support/hull/queries.h"
#include "tests/support/not_finite.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

constexpr double kExact_m = 1e-5;  // results within 0.01 mm of the truth count as exact
constexpr double kReach_m = 0.5;

TEST(Recovery, ExitsEqualTheExactReferenceOnRandomScenes) {
  Random random(41);
  int exits = 0, unconfirmed = 0;
  double worst_m = 0;
  for (int scene = 0; scene < 90; ++scene) {
    const auto silhouettes = silhouettes_of({random_cameras(random, 4), random_object(random, 4)});
    for (const hull::HullRule& rule : kRules) {
      const Queries hull(silhouettes, rule);
      for (int i = 0; i < 40; ++i) {
        const Vector3d p = random_in_ball(random, 0.25), direction = random_direction(random);
        if (!hull::in_hull(silhouettes, p, rule)) continue;
        const auto intervals =
            hull::reference_intervals(silhouettes, {p, direction}, 0, kReach_m, rule);
        ASSERT_FALSE(intervals.empty());
        const auto outward = collision::exit_outward(hull.query, p, direction, kReach_m),
                   from_base = collision::exit_from_base(hull.query, p, direction, kReach_m);
        ASSERT_EQ(outward.has_value(), intervals.front().leave < kReach_m);
        ASSERT_EQ(from_base.has_value(), intervals.back().leave < kReach_m);
        for (const auto& [exit, exact_m] : {std::pair{outward, intervals.front().leave},
                                            std::pair{from_base, intervals.back().leave}}) {
          if (!exit) continue;
          ++exits;
          worst_m = std::max(worst_m, std::abs(exit->distance_m - exact_m));
          if (exit->error_m < collision::kMaxRounding_m) {
            EXPECT_FALSE(hull::in_hull(silhouettes,
                                       p + (exit->distance_m + exit->error_m) * direction, rule));
            EXPECT_TRUE(hull::in_hull(silhouettes,
                                      p + (exit->distance_m - exit->error_m) * direction, rule));
          } else {
            ++unconfirmed;
          }
        }
      }
    }
  }
  std::cout << exits << " exits, " << worst_m * 1000
            << " mm largest difference from the exact reference, " << unconfirmed
            << " not confirmed by in_hull() within 1 um\n";
  EXPECT_GT(exits, 2000);
  EXPECT_LT(worst_m, kExact_m);
  EXPECT_LE(unconfirmed, exits / 1000);
}

// The stated error is the first of 1e-14 m, 2e-14 m, 4e-14 m, ... that contains() confirms.
TEST(Recovery, StatesTheSmallestErrorThatContainsConfirms) {
  Random random(46);
  int least = 0, larger = 0;
  for (const Vector3d& center : {Vector3d(0, 0, 0), Vector3d(1000, -700, 50)}) {
    std::vector<geometry::Camera> cameras = random_cameras(random, 5);
    for (geometry::Camera& c : cameras)
      c.camera_from_world.translation() -= c.camera_from_world.linear() * center;
    const auto silhouettes = silhouettes_of({{center, center, 0.1}}, cameras);
    const Queries hull(silhouettes);
    for (int i = 0; i < 100; ++i) {
      const Vector3d p = center + random_in_ball(random, 0.08),
                     direction = random_direction(random);
      const auto exit = collision::exit_outward(hull.query, p, direction, kReach_m);
      ASSERT_TRUE(exit);
      double expected_m = 1e-14;
      while (hull.query.contains(p + (exit->distance_m + expected_m) * direction) ||
             !hull.query.contains(p + (exit->distance_m - expected_m) * direction))
        expected_m *= 2;
      EXPECT_EQ(exit->error_m, expected_m);
      ++(expected_m == 1e-14 ? least : larger);
    }
  }
  EXPECT_GT(least, 0);
  EXPECT_GT(larger, 0);
}

// Cameras at 1 m and 2 m with pixels that are not square, and one that looks away from the point.
TEST(Recovery, PixelFootprintIsThatOfTheLargestPixel) {
  const auto footprint_m = [](const std::vector<geometry::Camera>& cameras) {
    const Queries hull(silhouettes_of({{{0, 0, 0}, {0, 0, 0}, 0.1}}, cameras));
    return collision::pixel_footprint_m(hull.query, Vector3d(0, 0, 0));
  };
  const auto camera = [](double x_m, double target_x_m, double fx_px, double fy_px) {
    return geometry::Camera{{100, 100, fx_px, fy_px, 49.5, 49.5},
                            geometry::look_at({x_m, 0, 0}, {target_x_m, 0, 0}, {0, 0, 1})};
  };
  const geometry::Camera near = camera(1, 0, 500, 250), far = camera(-2, 0, 400, 800),
                         away = camera(3, 6, 10, 10);
  EXPECT_NEAR(footprint_m({near}), 1.0 / 250, 1e-12);
  EXPECT_NEAR(footprint_m({far}), 2.0 / 400, 1e-12);
  EXPECT_NEAR(footprint_m({far, near, away}), 2.0 / 400, 1e-12);
  EXPECT_NEAR(footprint_m({near, far}), 2.0 / 400, 1e-12);
  EXPECT_EQ(footprint_m({away}), 0);
}

TEST(Recovery, SampledExitPrecedesTheExactOneByAtMostAStep) {
  Random random(42);
  const auto silhouettes = silhouettes_of({random_cameras(random, 4), random_object(random, 4)});
  const Queries hull(silhouettes);
  int missed = 0, exits = 0;
  for (int i = 0; i < 300; ++i) {
    const Vector3d p = random_in_ball(random, 0.25), direction = random_direction(random);
    if (!hull::in_hull(silhouettes, p)) continue;
    const auto exact = collision::exit_from_base(hull.query, p, direction, kReach_m),
               sampled = collision::exit_sampled(hull.query, p, direction, kReach_m, 400);
    ASSERT_EQ(exact.has_value(), sampled.has_value());
    if (!exact) continue;
    ++exits;
    EXPECT_LE(sampled->distance_m, exact->distance_m + exact->error_m);
    missed += exact->distance_m > sampled->distance_m + sampled->error_m;
  }
  EXPECT_GT(exits, 20);
  EXPECT_LE(missed, exits / 10);  // the hull is thinner than a step there
}

TEST(Recovery, CpObjectIsTheFarthestOrTheDeepestOfNearTies) {
  Random random(43);
  const auto silhouettes = silhouettes_of({{{0, 0, 0}, {0, 0, 0}, 0.1}}, random_cameras(random, 5));
  const Queries hull(silhouettes);
  for (int i = 0; i < 50; ++i) {
    std::vector<collision::CollisionPoint> points;
    for (int n = 0; n < 40; ++n)
      points.push_back({random_in_ball(random, 0.08), std::uint32_t(random() % 10)});
    const Vector3d rp = 0.2 * random_direction(random);
    const auto distance_m = [&](const collision::CollisionPoint& point) {
      return (point.p_world_m - rp).norm();
    };
    const collision::CollisionPoint &farthest = collision::cp_object(hull.query, points, rp),
                                    &deepest = collision::cp_object(hull.query, points, rp, 0.02);
    const auto depth_m = [&](const collision::CollisionPoint& point) {
      return hull::reference_intervals(silhouettes,
                                       {point.p_world_m, (rp - point.p_world_m).normalized()}, 0,
                                       distance_m(point))
          .front()
          .leave;
    };
    for (const collision::CollisionPoint& point : points) {
      EXPECT_LE(distance_m(point), distance_m(farthest));
      if (distance_m(point) >= distance_m(farthest) - 0.02) {
        EXPECT_LE(depth_m(point), depth_m(deepest) + 1e-9);
      }
    }
    EXPECT_GE(distance_m(deepest), distance_m(farthest) - 0.02);
  }
}

TEST(Recovery, ExitIsZeroOutsideTheHullAndAbsentWithinReach) {
  Random random(44);
  const auto silhouettes = silhouettes_of({{{0, 0, 0}, {0, 0, 0}, 0.1}}, random_cameras(random, 5));
  const Queries hull(silhouettes);
  const Vector3d outside(0, 0, 0.4), up(0, 0, 1);
  const auto outward = collision::exit_outward(hull.query, outside, up, 0.1),
             from_base = collision::exit_from_base(hull.query, outside, up, 0.1);
  for (const auto& exit :
       {outward, from_base, collision::exit_sampled(hull.query, outside, up, 0.1, 10)}) {
    ASSERT_TRUE(exit);
    EXPECT_EQ(exit->distance_m, 0);
  }
  // contains() is false on both sides, so the error is the largest one.
  EXPECT_EQ(outward->error_m, 1e-6);
  EXPECT_EQ(from_base->error_m, 1e-6);
  EXPECT_FALSE(collision::exit_outward(hull.query, {0, 0, 0}, up, 0.05));
  EXPECT_FALSE(collision::exit_from_base(hull.query, {0, 0, 0}, up, 0.05));
  EXPECT_EQ(collision::residual_m(hull.query, {}, up, 0.1), 0);
  const std::vector<collision::CollisionPoint> points{{{0, 0, 0.4}, 0}, {{0, 0, 0}, 1}};
  EXPECT_EQ(collision::residual_m(hull.query, points, up, 0.05), 0.05);
  const auto nan = collision::exit_outward(hull.query, {kNaN, 0, 0}, up, 0.05);
  EXPECT_TRUE(!nan || nan->distance_m == 0);
}

TEST(Recovery, LimitsSeenEqualsLimitsAllWhenAllCamerasSeeEverything) {
  Random random(45);
  int compared = 0;
  for (int i = 0; i < 40; ++i) {
    std::vector<geometry::Camera> cameras = random_cameras(random, 4);
    const auto silhouettes = silhouettes_of({{{0, 0, 0}, {0, 0, 0}, 0.05}}, cameras);
    const Queries all(silhouettes), seen(silhouettes, {hull::Limits::seen, 4});
    const Vector3d direction = random_direction(random);
    if (!hull::in_hull(silhouettes, Vector3d::Zero())) continue;
    const auto exit_all = collision::exit_from_base(all.query, Vector3d::Zero(), direction, 0.2);
    const auto exit_seen = collision::exit_from_base(seen.query, Vector3d::Zero(), direction, 0.2);
    ASSERT_EQ(exit_all.has_value(), exit_seen.has_value());
    if (!exit_all) continue;
    const collision::HullNormal a =
        collision::closed_form_normal(all.query, {Vector3d::Zero(), direction, 0.2, *exit_all});
    const collision::HullNormal b =
        collision::closed_form_normal(seen.query, {Vector3d::Zero(), direction, 0.2, *exit_seen});
    ASSERT_EQ(a.status, collision::NormalStatus::defined);
    EXPECT_EQ(b.status, a.status);
    EXPECT_LT((a.normal_world - b.normal_world).norm(), 1e-12);
    ++compared;
  }
  EXPECT_GT(compared, 20);
}

}  // namespace
}  // namespace fivepipe::test
