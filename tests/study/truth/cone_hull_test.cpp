// The hull of exact silhouette cones: points against the analytic oracle and against rays, and ends
// that have a closed form.
#include "tests/study/truth/cone_hull.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/collision/scene.h"

namespace fivepipe::test {
namespace {

using capture::SyntheticPart;
using Eigen::Vector3d;

constexpr double kTolerance_m = 1e-5;

SyntheticPart skin(const hull::Capsule& capsule) { return {capsule, capture::Material::skin}; }

std::vector<SyntheticPart> parts_of(const std::vector<hull::Capsule>& capsules) {
  std::vector<SyntheticPart> parts;
  for (const hull::Capsule& capsule : capsules) parts.push_back(skin(capsule));
  return parts;
}

TEST(ConeHull, ContainsThePointsOfTheOracle) {
  const std::vector<hull::Capsule> object{{{-0.1, 0, 0.1}, {0.1, 0.05, 0}, 0.03},
                                          {{0, 0.1, 0.15}, {0, 0.1, 0.15}, 0.05}};
  const std::vector<geometry::Camera> cameras = ring(3, 2, 0.6, 400, 1.5);
  const ConeHull hull(parts_of(object), cameras);
  Random random(3);
  int inside = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vector3d p{uniform(random, -0.2, 0.2), uniform(random, -0.2, 0.2),
                     uniform(random, -0.1, 0.3)};
    EXPECT_EQ(hull.contains(p), hull::in_analytic_hull(object, cameras, p)) << p.transpose();
    inside += hull.contains(p);
  }
  EXPECT_GT(inside, 300);
}

TEST(ConeHull, ABoxIsSeenWhereRaysMeetIt) {
  const geometry::OrientedBox box{
      Eigen::Translation3d(0.02, 0, 0.1) * Eigen::AngleAxisd(0.5, Vector3d(1, 2, 3).normalized()),
      {0.05, 0.1, 0.02}};
  const std::vector<geometry::Camera> cameras = ring(3, 2, 0.4, 400, 1.5);
  const ConeHull hull(std::vector<SyntheticPart>{{box, capture::Material::wood}}, cameras);
  Random random(4);
  int inside = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vector3d p{uniform(random, -0.2, 0.2), uniform(random, -0.2, 0.2),
                     uniform(random, -0.1, 0.3)};
    const bool seen = std::ranges::all_of(cameras, [&](const geometry::Camera& camera) {
      const Vector3d eye = geometry::camera_center_world_m(camera);
      return geometry::ray_entry(box, {eye, p - eye}).has_value();
    });
    EXPECT_EQ(hull.contains(p), seen) << p.transpose();
    inside += seen;
  }
  EXPECT_GT(inside, 300);
}

// A ball that misses a cone holds no point of it.
TEST(ConeHull, NoPointOfABallThatMissesIsInTheCone) {
  const hull::Capsule capsule{{-0.3, 0, 1.5}, {0.4, 0.1, 2.5}, 0.05};
  const geometry::OrientedBox box{
      Eigen::Translation3d(0.1, 0, 2) * Eigen::AngleAxisd(0.4, Vector3d(1, 1, 0).normalized()),
      {0.2, 0.1, 0.3}};
  const CapsuleCone of_capsule(capsule, kOrigin);
  const BoxCone of_box(box, kOrigin);
  Random random(5);
  const auto point = [&] {
    return Vector3d{uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, 0.3, 3)};
  };
  int missed = 0, close = 0;
  for (int i = 0; i < 3000; ++i) {
    const Vector3d center = point();
    const double radius_m = uniform(random, 0.01, 0.3);
    for (const bool is_box : {false, true}) {
      const auto misses = [&](const Vector3d& p, double r) {
        return is_box ? of_box.misses(p, r) : of_capsule.misses(p, r);
      };
      if (!misses(center, radius_m)) {
        close += misses(center, 0.2 * radius_m);
        continue;
      }
      ++missed;
      for (int k = 0; k < 10; ++k) {
        const Vector3d direction = point().normalized();
        const Vector3d p = center + radius_m * uniform(random, 0, 1) * direction;
        EXPECT_TRUE(misses(p, 0));
      }
    }
  }
  EXPECT_GT(missed, 1000);
  EXPECT_GT(close, 100) << "no ball is larger than the distance of its centre";
}

// One camera at the height of a ball's centre: its cone touches the ball, and in the prism of a box
// behind the ball it ends at the far face.
TEST(ConeHull, EndsWhereTheConeOfABallMeetsThePrism) {
  constexpr double kDistance_m = 2, kBall_m = 0.1, kHalf_m = 0.3;
  const geometry::Camera camera = camera_at({-kDistance_m, 0, 0}, 400, 2);
  const ConeHull hull(parts_of({ball(kOrigin, kBall_m)}), {{camera}});
  const BoxOnAxis box{Eigen::Isometry3d::Identity(), {kHalf_m, kHalf_m, 0.1}};
  const double slope = kBall_m / std::sqrt(kDistance_m * kDistance_m - kBall_m * kBall_m),
               end_m = (kDistance_m + kHalf_m) * slope;
  const ConeHull::Bound high = hull.highest(box, {-1, 1}, kTolerance_m),
                        low = hull.lowest(box, {-1, 1}, kTolerance_m);
  EXPECT_LE(high.min_m, end_m);
  EXPECT_GE(high.max_m, end_m);
  EXPECT_LE(high.max_m - high.min_m, kTolerance_m);
  EXPECT_LE(low.min_m, -end_m);
  EXPECT_GE(low.max_m, -end_m);
  EXPECT_LE(low.max_m - low.min_m, kTolerance_m);
}

TEST(ConeHull, ReportsThatNothingIsInTheHeights) {
  const ConeHull hull(parts_of({ball(kOrigin, 0.1)}), ring(3, 2, 0.3, 400, 2));
  const BoxOnAxis box{Eigen::Isometry3d::Identity(), {0.3, 0.3, 0.1}};
  const ConeHull::Bound none = hull.highest(box, {0.3, 1}, kTolerance_m);
  EXPECT_TRUE(std::isinf(none.min_m));
  EXPECT_LE(none.max_m, 0.3 + kTolerance_m);
  const ConeHull::Bound below = hull.lowest(box, {-1, -0.3}, kTolerance_m);
  EXPECT_TRUE(std::isinf(below.max_m));
  EXPECT_GE(below.min_m, -0.3 - kTolerance_m);
}

// The end is that of the highest of many points that are in the hull.
TEST(ConeHull, NoSampledPointIsBeyondTheEnd) {
  const std::vector<hull::Capsule> object{{{-0.1, 0, 0.1}, {0.1, 0.05, 0}, 0.03},
                                          {{0.02, 0.1, 0.15}, {0, -0.1, 0.12}, 0.02}};
  const ConeHull hull(parts_of(object), ring(4, 2, 0.5, 400, 1.5));
  const BoxOnAxis box{Eigen::Isometry3d(Eigen::Translation3d(0.03, 0, 0)), {0.05, 0.08, 0.1}};
  const ConeHull::Bound high = hull.highest(box, {-0.5, 0.5}, 1e-4);
  Random random(6);
  double highest_m = -1;
  for (int i = 0; i < 200000; ++i) {
    const Vector3d p{uniform(random, -0.05, 0.05), uniform(random, -0.08, 0.08),
                     uniform(random, 0, 0.3)};
    if (hull.contains(box.world_from_box * p)) highest_m = std::max(highest_m, p.z());
  }
  EXPECT_LE(highest_m, high.max_m);
  EXPECT_NEAR(highest_m, high.max_m, 0.01) << "the samples reach the end";
}

}  // namespace
}  // namespace fivepipe::test
