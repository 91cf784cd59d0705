// HullDistance: compared with closed forms and with an exhaustive search over the pixels.
#include <algorithm>
#include <limits>

#include "common/collision/oracle/distance_reference.h"
#include "common/hull/oracle/reference.h"
#include "tests/support/collision/scene.h"
#include "tests/support/not_finite.h"

namespace fivepipe::test {
namespace {

constexpr double kRounding_m = 1e-12;  // for coordinates of a few metres

// A camera whose full map is the pyramid |X|, |Y| < Z. A pixel is 1 / 50.5 wide at Z = 1.
hull::Silhouette right_angled(
    const Eigen::Isometry3d& camera_from_world = Eigen::Isometry3d::Identity()) {
  hull::Silhouette s{{{101, 101, 50.5, 50.5, 50, 50}, camera_from_world},
                     hull::ObjectPixels(101, 101)};
  for (int v = 0; v < 101; ++v)
    for (int u = 0; u < 101; ++u) s.pixels.set(u, v);
  return s;
}

// Distance to the pyramid of one pixel, in the camera's frame. The squared distance to its square
// at depth t is convex in t, so a ternary search finds the minimum.
double to_pixel_m(const geometry::Pinhole& k, const Eigen::Vector3d& p, double u0, double v0,
                  double u1, double v1) {
  const auto distance2 = [&](double t) {
    const double x = std::clamp(p.x(), t * (u0 - k.cx_px) / k.fx_px, t * (u1 - k.cx_px) / k.fx_px);
    const double y = std::clamp(p.y(), t * (v0 - k.cy_px) / k.fy_px, t * (v1 - k.cy_px) / k.fy_px);
    return (p - Eigen::Vector3d(x, y, t)).squaredNorm();
  };
  double low = 0, high = p.norm();
  for (int i = 0; i < 120; ++i) {
    const double a = low + (high - low) / 3, b = high - (high - low) / 3;
    (distance2(a) < distance2(b) ? high : low) = distance2(a) < distance2(b) ? b : a;
  }
  return std::sqrt(std::min(distance2(0.5 * (low + high)), p.squaredNorm()));
}

// Computes HullDistance::signed_m() by its definition over every pixel. A frame of one pixel around
// the image represents its outside, which suffices because the images are narrow.
double by_every_pixel_m(std::span<const hull::Silhouette> silhouettes,
                        const Eigen::Vector3d& p_world_m) {
  double min_m = kInfinity;
  for (const hull::Silhouette& s : silhouettes) {
    const bool inside = hull::in_hull({&s, 1}, p_world_m);
    double nearest_m = kInfinity;
    for (int v = -1; v <= s.pixels.height_px(); ++v)
      for (int u = -1; u <= s.pixels.width_px(); ++u)
        if (s.pixels.contains(u, v) != inside)
          nearest_m = std::min(nearest_m,
                               to_pixel_m(s.camera.pinhole, s.camera.camera_from_world * p_world_m,
                                          u - 0.5, v - 0.5, u + 0.5, v + 0.5));
    min_m = std::min(min_m, inside ? nearest_m : -nearest_m);
  }
  return min_m;
}

TEST(HullDistance, AgreesWithTheClosedFormOfAFullImage) {
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Isometry3d pose = random_look_at(random, random_in_ball(random, 3), kOrigin, 1);
    const std::vector<hull::Silhouette> silhouettes{right_angled(pose)};
    const collision::HullDistance hull(silhouettes);
    const auto signed_m = [&](double x, double y, double z) {
      return hull.signed_m(pose.inverse() * Eigen::Vector3d(x, y, z));
    };
    const double z = uniform(random, 0.1, 2), x = uniform(random, -0.9, 0.9) * z,
                 y = uniform(random, -0.9, 0.9) * z;
    EXPECT_NEAR(signed_m(x, y, z), (z - std::max(std::abs(x), std::abs(y))) / std::sqrt(2),
                kRounding_m);  // the nearest border is a face
    EXPECT_NEAR(signed_m(z, 0.4 * (x + z), x), (x - z) / std::sqrt(2),
                kRounding_m);  // a face, from outside the pyramid
    // the nearest border is an edge
    EXPECT_NEAR(signed_m(z, z, 0), -z * std::sqrt(2.0 / 3), kRounding_m);
    EXPECT_NEAR(signed_m(0.2 * z, x / 4, -z), -std::sqrt(1.04 * z * z + x * x / 16),
                kRounding_m);  // the camera's center, from behind the camera
  }
}

TEST(HullDistance, AgreesWithTheClosedFormOfAOnePixelHole) {
  std::vector<hull::Silhouette> silhouettes{right_angled()};
  silhouettes[0].pixels.set(50, 50, false);  // |X|, |Y| < Z / 101
  const collision::HullDistance hull(silhouettes);
  const double per_length = 1 / std::sqrt(1 + 1 / (101.0 * 101));
  EXPECT_NEAR(hull.depth_m({0.3, 0, 1}), (0.3 - 1 / 101.0) * per_length, kRounding_m);
  EXPECT_NEAR(hull.signed_m({0.004, 0.001, 1}), -(1 / 101.0 - 0.004) * per_length, kRounding_m);
  EXPECT_EQ(hull.depth_m({0.004, 0.001, 1}), 0);
}

TEST(HullDistance, AgreesWithAnExhaustiveSearchOverThePixels) {
  Random random(2);
  int inside = 0, outside = 0;
  for (int i = 0; i < 24; ++i) {
    const auto cameras = random_cameras(random, 1 + i % 3, 37, 29);
    auto silhouettes = silhouettes_of(random_object(random, 3), cameras);
    if (i % 3 == 0)
      for (hull::Silhouette& s : silhouettes)
        s.pixels = random_pixels(random, 37, 29, i % 2 ? 0.97 : 0.1);
    const collision::HullDistance hull(silhouettes);
    for (int k = 0; k < 8; ++k) {
      // some of them behind cameras
      const Eigen::Vector3d p = random_in_ball(random, k == 0 ? 3 : 0.2);
      const double signed_m = hull.signed_m(p);
      EXPECT_NEAR(signed_m, by_every_pixel_m(silhouettes, p),
                  1e-8);  // The search resolves a minimum only to the root of the rounding.
      ++(signed_m > 0 ? inside : outside);
    }
  }
  EXPECT_GT(inside, 20);
  EXPECT_GT(outside, 20);
}

TEST(HullDistance, TheBallOfTheSignedDistanceIsWhollyInOrWhollyOutOfTheHull) {
  Random random(3);
  auto silhouettes = hand_among();
  silhouettes[1].camera.camera_from_world.linear() *=
      1 + 0.4 * geometry::kMaxRotationError;  // a rotation that is slightly not orthonormal
  silhouettes[2].camera.camera_from_world.linear()(0, 1) += 0.4 * geometry::kMaxRotationError;
  for (const hull::Silhouette& s : silhouettes) ASSERT_FALSE(geometry::why_unusable(s.camera));
  const collision::HullDistance hull(silhouettes);
  int inside = 0;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d p = random_in_ball(random, 0.12);
    const double signed_m = hull.signed_m(p);
    for (int k = 0; k < 50; ++k)
      EXPECT_EQ(hull::in_hull(silhouettes,
                              p + (std::abs(signed_m) - kRounding_m) * random_direction(random)),
                signed_m > 0);
    const Eigen::Vector3d other = random_in_ball(random, 0.12);
    EXPECT_LE(std::abs(signed_m - hull.signed_m(other)), (p - other).norm() + kRounding_m);
    inside += signed_m > 0;
  }
  EXPECT_GT(inside, 30);
}

// Compares the bounds with the first hull points along 4000 random directions: none is nearer than
// min_m, and the nearest is at most as far as max_m plus the error of the sampled directions. One
// of them is within 0.1 rad of the nearest point's direction.
TEST(HullDistance, ClearanceBoundsTheDistanceToTheHull) {
  Random random(4);
  const auto silhouettes = hand_among();
  const collision::HullDistance hull(silhouettes);
  constexpr double kCap_m = 0.2, kTolerance_m = 5e-4;
  for (int i = 0; i < 12; ++i) {
    const Eigen::Vector3d p = 0.15 * random_direction(random);
    const auto [min_m, max_m] = hull.clearance_m(p, kCap_m, kTolerance_m);
    double nearest_m = kInfinity;
    for (int k = 0; k < 4000; ++k)
      for (const hull::Interval& in :
           hull::reference_intervals(silhouettes, {p, random_direction(random)}, 0, kCap_m))
        nearest_m = std::min(nearest_m, in.enter);
    ASSERT_LT(nearest_m, kCap_m);
    EXPECT_GE(min_m, -hull.signed_m(p));
    EXPECT_LE(min_m, nearest_m + kRounding_m);
    EXPECT_LE(max_m, nearest_m + kTolerance_m);
    EXPECT_LE(nearest_m, max_m + 0.005);
    EXPECT_LE(min_m, max_m);
    EXPECT_LE(max_m - min_m, kTolerance_m);
  }
}

TEST(HullDistance, ClearanceAgreesWithTheClosedFormOfAPyramid) {
  const std::vector<hull::Silhouette> silhouettes{right_angled()};
  const collision::HullDistance hull(silhouettes);
  constexpr double kTolerance_m = 1e-3;
  const auto clearance = hull.clearance_m({1.2, 0.1, 1}, 0.5, kTolerance_m);
  EXPECT_LE(clearance.min_m, 0.2 / std::sqrt(2) + kRounding_m);
  // with one camera the bound is exact
  EXPECT_GE(clearance.min_m, 0.2 / std::sqrt(2) - kRounding_m);
  EXPECT_GE(clearance.max_m, 0.2 / std::sqrt(2) - kRounding_m);
  EXPECT_LE(clearance.max_m, 0.2 / std::sqrt(2) + kTolerance_m);
  const auto inside = hull.clearance_m({0, 0, 1}, 0.5, kTolerance_m);
  EXPECT_EQ(inside.min_m, 0);
  EXPECT_EQ(inside.max_m, 0);
  const auto beyond_the_cap = hull.clearance_m({3, 0, 1}, 0.5, kTolerance_m);
  EXPECT_EQ(beyond_the_cap.min_m, 0.5);
  EXPECT_EQ(beyond_the_cap.max_m, kInfinity);
}

// The cones of two opposed cameras pass close to p on both sides and meet only far above it.
TEST(HullDistance, ClearanceExceedsTheDistanceToEveryCone) {
  std::vector<hull::Silhouette> silhouettes;
  for (const double z : {-1.0, 1.0}) {
    hull::Silhouette s{camera_at({0, 0, z}, 100, 1, kOrigin, Eigen::Vector3d::UnitY()),
                       hull::ObjectPixels(100, 100)};
    for (int v = 0; v < 100; ++v)
      for (int u = 0; u < 100; ++u)
        if (u < 45 || v < 20) s.pixels.set(u, v);
    silhouettes.push_back(s);
  }
  const collision::HullDistance hull(silhouettes);
  const Eigen::Vector3d p = kOrigin;
  ASSERT_LT(hull.signed_m(p), 0);
  const auto clearance = hull.clearance_m(p, 0.5, 1e-3);
  double nearest_m = kInfinity;
  Random random(5);
  for (int k = 0; k < 4000; ++k)
    for (const hull::Interval& in :
         hull::reference_intervals(silhouettes, {p, random_direction(random)}, 0, 0.5))
      nearest_m = std::min(nearest_m, in.enter);
  EXPECT_GT(clearance.min_m, -2 * hull.signed_m(p));
  EXPECT_LE(clearance.min_m, nearest_m + kRounding_m);
  EXPECT_LE(clearance.max_m, nearest_m + 1e-3);
}

TEST(HullDistance, GivesTheSameDistancesOneKilometreFromTheOrigin) {
  Random random(6);
  const Eigen::Vector3d far_away_m(1000, -700, 50);
  const auto here = hand_among(), there = hand_among(4, 200, far_away_m);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d p = random_in_ball(random, 0.1);
    EXPECT_NEAR(collision::HullDistance(there).signed_m(p + far_away_m),
                collision::HullDistance(here).signed_m(p), 1e-11);  // coordinates round to 1e-13 m
  }
}

TEST(HullDistance, AnEmptyHullIsInfinitelyFar) {
  auto silhouettes = hand_among();
  silhouettes[1].pixels = hull::ObjectPixels(200, 200);
  EXPECT_EQ(collision::HullDistance(silhouettes).signed_m(kOrigin), -kInfinity);
  EXPECT_EQ(collision::HullDistance(silhouettes).clearance_m(kOrigin, 0.3, 1e-3).min_m, 0.3);
  EXPECT_EQ(collision::HullDistance({}).signed_m(kOrigin), -kInfinity);
  silhouettes = hand_among();
  silhouettes[1].camera.pinhole.fx_px = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(collision::HullDistance(silhouettes).signed_m(kOrigin), -kInfinity);
}

TEST(HullDistance, APointThatIsNotFiniteHasNoDepthAndNoBound) {
  const auto silhouettes = hand_among();
  const collision::HullDistance hull(silhouettes);
  const Eigen::Vector3d p(0, std::numeric_limits<double>::quiet_NaN(), 0);
  EXPECT_EQ(hull.signed_m(p), -kInfinity);
  EXPECT_EQ(hull.depth_m(p), 0);
  EXPECT_EQ(hull.clearance_m(p, 1, 1e-3).min_m, 0);
  EXPECT_EQ(hull.clearance_m(p, 1, 1e-3).max_m, kInfinity);
}

TEST(HullDistance, ClearRadiusIsTheDistanceOutsideUpToItsMaximum) {
  Random random(21);
  const auto silhouettes =
      silhouettes_of({random_cameras(random, 3, 60, 45), random_object(random, 3)});
  const collision::HullDistance hull(silhouettes);
  int clear = 0, inside = 0, at_maximum = 0;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d p = random_in_ball(random, i % 2 ? 0.1 : 0.6);
    const double outside_m = std::max(0.0, -hull.signed_m(p)), max_m = uniform(random, 0, 0.2);
    EXPECT_EQ(hull.clear_m(p, max_m), std::min(max_m, outside_m));
    ++(outside_m == 0 ? inside : outside_m < max_m ? clear : at_maximum);
  }
  EXPECT_GT(std::min({clear, inside, at_maximum}), 10);
  EXPECT_EQ(hull.clear_m({kInfinity, 0, 0}, 0.1), 0);
  const collision::HullDistance no_hull(std::span<const hull::Silhouette>{});
  EXPECT_EQ(no_hull.clear_m({0, 0, 0}, 0.1), 0.1);
}

}  // namespace
}  // namespace fivepipe::test
