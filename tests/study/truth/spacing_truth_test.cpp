// The closed form of the spacings at which a box meets a shape, against sampled points.
#include "tests/study/truth/spacing_truth.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "tests/support/hull/scenes.h"

namespace fivepipe::test {
namespace {

using capture::SyntheticPart;
using Eigen::Vector3d;

const BoxOnAxis kBox{Eigen::Isometry3d::Identity(), Vector3d(0.1, 0.2, 0.05)};

SyntheticPart capsule(const Vector3d& a_m, const Vector3d& b_m, double radius_m) {
  return {hull::Capsule{a_m, b_m, radius_m}, capture::Material::skin};
}
SyntheticPart block(const Eigen::Isometry3d& pose, const Vector3d& half_m) {
  return {geometry::OrientedBox{pose, half_m}, capture::Material::wood};
}

void expect_heights(const SyntheticPart& part, double low_m, double high_m) {
  const auto heights = heights_in_prism(kBox, part);
  ASSERT_TRUE(heights);
  EXPECT_NEAR(heights->low_m, low_m, 1e-12);
  EXPECT_NEAR(heights->high_m, high_m, 1e-12);
}

TEST(SpacingTruth, BallsAndUprightCapsules) {
  expect_heights(capsule({0, 0, 0.3}, {0, 0, 0.3}, 0.04), 0.26, 0.34);
  expect_heights(capsule({0, 0, -0.1}, {0, 0, 0.3}, 0.04), -0.14, 0.34);
  // Its centre is 3 cm outside: 3, 4, 5.
  expect_heights(capsule({0.13, 0, 0.3}, {0.13, 0, 0.3}, 0.05), 0.26, 0.34);
  // Beyond an edge of the prism: 3 and 4 cm of 13.
  expect_heights(capsule({0.13, 0.24, 0}, {0.13, 0.24, 0}, 0.13), -0.12, 0.12);
  EXPECT_FALSE(heights_in_prism(kBox, capsule({0.16, 0, 0}, {0.16, 0, 0}, 0.05)));
  EXPECT_FALSE(heights_in_prism(kBox, capsule({0.14, 0.24, 0}, {0.14, 0.24, 0.3}, 0.05)));
  // It touches a face of the prism, so that rounding of the distance counts by its square root.
  const auto touching = heights_in_prism(kBox, capsule({0.15, 0, 0.1}, {0.15, 0, 0.1}, 0.05));
  ASSERT_TRUE(touching);
  EXPECT_NEAR(touching->low_m, 0.1, 1e-8);
  EXPECT_NEAR(touching->high_m, 0.1, 1e-8);
}

TEST(SpacingTruth, ASlopingCapsuleEndsAtTheFaceOfThePrism) {
  // Slope 3/4; the highest point in the prism is on the capsule's upper side, at x = 0.1.
  const double radius_m = 0.02, above_m = radius_m * std::hypot(1, 0.75);
  expect_heights(capsule({-1, 0, -0.75}, {1, 0, 0.75}, radius_m), -0.075 - above_m,
                 0.075 + above_m);
}

TEST(SpacingTruth, Boxes) {
  const Eigen::Isometry3d at(Eigen::Translation3d(0.1, 0, 0.5));
  expect_heights(block(at, {0.03, 0.04, 0.05}), 0.45, 0.55);
  // Stands on an edge, which is outside the prism by 1 cm.
  const Eigen::Isometry3d tilted = Eigen::Translation3d(0.11, 0, 0.5) *
                                   Eigen::AngleAxisd(0.25 * std::numbers::pi, Vector3d::UnitY());
  const double half_diagonal_m = 0.05 * std::numbers::sqrt2;
  expect_heights(block(tilted, {0.05, 0.04, 0.05}), 0.5 - half_diagonal_m + 0.01,
                 0.5 + half_diagonal_m - 0.01);
  // Larger than the prism: a corner of the prism is in its faces.
  const Eigen::Isometry3d slope(Eigen::AngleAxisd(std::atan(0.5), Vector3d::UnitY()));
  const double above_m = 0.01 * std::hypot(1, 0.5);
  expect_heights(block(slope, {2, 2, 0.01}), -0.05 - above_m, 0.05 + above_m);
  EXPECT_FALSE(heights_in_prism(
      kBox, block(Eigen::Isometry3d(Eigen::Translation3d(0.2, 0, 0)), {0.05, 1, 1})));
}

bool is_in(const SyntheticPart& part, const Vector3d& p) {
  if (const auto* c = std::get_if<hull::Capsule>(&part.shape)) {
    const Vector3d d = c->b_world_m - c->a_world_m;
    const double t =
        d.squaredNorm() > 0 ? std::clamp((p - c->a_world_m).dot(d) / d.squaredNorm(), 0.0, 1.0) : 0;
    return (p - c->a_world_m - t * d).norm() <= c->radius_m;
  }
  const auto& box = std::get<geometry::OrientedBox>(part.shape);
  return ((box.world_from_box.inverse() * p).cwiseAbs() - box.half_m).maxCoeff() <= 0;
}

// Points of the prism on a grid: none in the shape is outside the heights, and some are near their
// ends.
TEST(SpacingTruth, ContainsSampledPointsOfRandomShapes) {
  Random random(11);
  const auto point = [&](double size_m) {
    return Vector3d{uniform(random, -size_m, size_m), uniform(random, -size_m, size_m),
                    uniform(random, -size_m, size_m)};
  };
  constexpr int kSteps = 40;
  constexpr double kReach_m = 0.6;
  int found = 0;
  for (int trial = 0; trial < 40; ++trial) {
    Eigen::Isometry3d pose(Eigen::Translation3d(point(0.25)));
    pose.rotate(Eigen::AngleAxisd{uniform(random, 0, 3), point(1).normalized()});
    const Eigen::Vector3d a = point(0.3), b = point(0.3), half = point(0.12).cwiseAbs();
    const SyntheticPart part = trial % 2 == 0 ? capsule(a, b, uniform(random, 0.02, 0.1))
                                              : block(pose, half + Vector3d::Constant(0.01));
    const auto heights = heights_in_prism(kBox, part);
    double low_m = kReach_m, high_m = -kReach_m;
    for (int i = 0; i <= kSteps; ++i)
      for (int j = 0; j <= kSteps; ++j)
        for (int k = 0; k <= 2 * kSteps; ++k) {
          const Vector3d p(kBox.half_m.x() * (2.0 * i / kSteps - 1),
                           kBox.half_m.y() * (2.0 * j / kSteps - 1),
                           kReach_m * (2.0 * k / (2 * kSteps) - 1));
          if (!is_in(part, p)) continue;
          low_m = std::min(low_m, p.z());
          high_m = std::max(high_m, p.z());
        }
    if (!heights) {
      EXPECT_GT(low_m, high_m) << trial;
      continue;
    }
    if (low_m > high_m) continue;
    ++found;
    EXPECT_GE(low_m, heights->low_m - 1e-12) << trial;
    EXPECT_LE(high_m, heights->high_m + 1e-12) << trial;
    // Three steps of the grid: near an edge of a steep box, no nearer point is in it.
    constexpr double kNear_m = 3 * 2 * kReach_m / (2 * kSteps);
    EXPECT_NEAR(low_m, heights->low_m, kNear_m) << trial;
    EXPECT_NEAR(high_m, heights->high_m, kNear_m) << trial;
  }
  EXPECT_GT(found, 12);
}

TEST(SpacingTruth, TheAxisIsAnEdgeOfTheBox) {
  const Eigen::Isometry3d pose =
      Eigen::Translation3d(1, 2, 3) * Eigen::AngleAxisd(0.3, Vector3d::UnitZ());
  const Vector3d size_m(0.2, 0.4, 0.6);
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-1.0, 1.0}) {
      const Vector3d axis_world = sign * pose.linear().col(axis);
      const BoxOnAxis box = box_on_axis(pose, size_m, 2 * axis_world);
      EXPECT_NEAR((box.world_from_box.linear().col(2) - axis_world).norm(), 0, 1e-12);
      EXPECT_NEAR(box.world_from_box.linear().determinant(), 1, 1e-12);
      EXPECT_EQ(box.half_m.z(), 0.5 * size_m[axis]);
      // The same eight corners: the sizes along the world's axes agree.
      EXPECT_NEAR(((box.world_from_box.linear().cwiseAbs() * box.half_m) -
                   (pose.linear().cwiseAbs() * 0.5 * size_m))
                      .norm(),
                  0, 1e-12);
    }
  EXPECT_THROW(box_on_axis(pose, size_m, Vector3d::UnitX()), std::invalid_argument);
  EXPECT_THROW(box_on_axis(pose, size_m, Vector3d::Zero()), std::invalid_argument);
}

TEST(SpacingTruth, TheFreeSpacingsAreTheRest) {
  const std::vector<SyntheticPart> parts{capsule({0, 0, 0.3}, {0, 0, 0.3}, 0.04),
                                         capsule({0, 0, 0.32}, {0, 0, 0.32}, 0.04),
                                         capsule({0, 0, 0.6}, {0, 0, 0.6}, 0.01)};
  const std::vector<SpacingInterval> colliding = colliding_spacings(kBox, parts);
  ASSERT_EQ(colliding.size(), 2u);
  EXPECT_NEAR(colliding[0].low_m, 0.21, 1e-12);
  EXPECT_NEAR(colliding[0].high_m, 0.41, 1e-12);
  EXPECT_NEAR(colliding[1].low_m, 0.54, 1e-12);
  EXPECT_NEAR(colliding[1].high_m, 0.66, 1e-12);
  const std::vector<SpacingInterval> free = complement(colliding, {0.3, 0.6});
  ASSERT_EQ(free.size(), 1u);
  EXPECT_EQ(free[0], (SpacingInterval{colliding[0].high_m, colliding[1].low_m}));
  EXPECT_EQ(complement({}, {0, 1}), (std::vector<SpacingInterval>{{0, 1}}));
  EXPECT_EQ(complement(colliding, {0, 1}).size(), 3u);
  EXPECT_TRUE(complement(colliding, {0.25, 0.4}).empty());
}

}  // namespace
}  // namespace fivepipe::test
