// The crossing of a moving point and a moving triangle.
#include "common/collision/proximity/moving_triangle.h"

#include <gtest/gtest.h>

#include "tests/support/hull/scenes.h"
#include "tests/support/not_finite.h"

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

const Triangle kTriangle = {Vector3d(0, 0, 0), Vector3d(1, 0, 0), Vector3d(0, 1, 0)};

MovingTriangle resting(const Triangle& triangle) { return {triangle, triangle}; }

Triangle shifted(Triangle triangle, const Vector3d& by) {
  for (Vector3d& corner : triangle) corner += by;
  return triangle;
}

TEST(MovingTriangle, APointCrossesWhereItsPathMeetsTheTriangle) {
  const auto found = crossing(resting(kTriangle), {0.2, 0.3, 0.25}, {0.2, 0.3, -0.75});
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->at, 0.25, 1e-15);
  EXPECT_TRUE(found->weights.isApprox(Vector3d(0.5, 0.2, 0.3), 1e-15));
  EXPECT_EQ(found->side, 1);
  const auto from_behind = crossing(resting(kTriangle), {0.2, 0.3, -0.75}, {0.2, 0.3, 0.25});
  ASSERT_TRUE(from_behind);
  EXPECT_EQ(from_behind->side, -1);
}

TEST(MovingTriangle, APointThatPassesBesideOrStopsBeforeItDoesNotCross) {
  EXPECT_FALSE(crossing(resting(kTriangle), {0.6, 0.6, 0.2}, {0.6, 0.6, -0.2}));
  EXPECT_FALSE(crossing(resting(kTriangle), {-0.01, 0.5, 0.2}, {-0.01, 0.5, -0.2}));
  EXPECT_FALSE(crossing(resting(kTriangle), {0.2, 0.2, 0.2}, {0.2, 0.2, 0.1}));
  EXPECT_FALSE(crossing(resting(kTriangle), {0.2, 0.2, 0}, {0.2, 0.2, 0}));
}

// Otherwise the next step would begin on the plane, from which no side is known.
TEST(MovingTriangle, APointThatEndsOnThePlaneHasCrossed) {
  for (const double side : {1.0, -1.0}) {
    const auto found = crossing(resting(kTriangle), {0.2, 0.3, side * 0.25}, {0.2, 0.3, 0});
    ASSERT_TRUE(found);
    EXPECT_EQ(found->at, 1);
    EXPECT_EQ(found->side, side);
    EXPECT_FALSE(crossing(resting(kTriangle), {0.2, 0.3, 0}, {0.2, 0.3, side * 0.25}));
  }
}

TEST(MovingTriangle, ATriangleSweepsAPointAtRest) {
  const MovingTriangle sweeps = {kTriangle, shifted(kTriangle, {0.1, 0, -1})};
  const auto found = crossing(sweeps, {0.3, 0.3, -0.5}, {0.3, 0.3, -0.5});
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->at, 0.5, 1e-15);
  EXPECT_NEAR(found->weights.y(), 0.25, 1e-15);  // the triangle has moved by 0.05 along x
  EXPECT_EQ(found->side, -1);
  // Both move alike.
  EXPECT_FALSE(crossing(sweeps, {0.3, 0.3, -0.5}, {0.4, 0.3, -1.5}));
}

// The reference tests random paths by the signs of the volumes that they span with the corners.
TEST(MovingTriangle, AgreesWithTheSignsOfVolumesForEveryOrderOfCorners) {
  test::Random random(7);
  int crossed = 0;
  for (int i = 0; i < 10'000; ++i) {
    Triangle t;
    for (Vector3d& corner : t) corner = test::random_in_ball(random, 1);
    const Vector3d p = test::random_in_ball(random, 1), q = test::random_in_ball(random, 1);
    const auto volume = [](const Vector3d& a, const Vector3d& b, const Vector3d& c,
                           const Vector3d& d) { return (b - a).cross(c - a).dot(d - a); };
    const bool other_sides = volume(t[0], t[1], t[2], p) * volume(t[0], t[1], t[2], q) < 0;
    const double a = volume(p, q, t[0], t[1]), b = volume(p, q, t[1], t[2]),
                 c = volume(p, q, t[2], t[0]);
    const bool passes = (a > 0 && b > 0 && c > 0) || (a < 0 && b < 0 && c < 0);
    const bool expected = other_sides && passes;
    crossed += expected;
    for (const auto& [i0, i1, i2] :
         {std::array{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}) {
      const Triangle permuted = {t[std::size_t(i0)], t[std::size_t(i1)], t[std::size_t(i2)]};
      EXPECT_EQ(crossing(resting(permuted), p, q).has_value(), expected) << i;
    }
  }
  EXPECT_GT(crossed, 300);
}

TEST(MovingTriangle, WithoutAreaOrFiniteCoordinatesNothingCrosses) {
  const Triangle line = {Vector3d(0, 0, 0), Vector3d(1, 0, 0), Vector3d(2, 0, 0)};
  EXPECT_FALSE(crossing(resting(line), {0.5, 0, 1}, {0.5, 0, -1}));
  EXPECT_EQ(barycentric_weights(line, {0.5, 0, 1}), Vector3d::Constant(1.0 / 3));
  for (const double bad : {test::kNaN, test::kInfinity}) {
    EXPECT_FALSE(crossing(resting(kTriangle), {0.2, bad, 1}, {0.2, 0.2, -1}));
    EXPECT_FALSE(crossing(resting(kTriangle), {0.2, 0.2, 1}, {0.2, 0.2, bad}));
    Triangle t = kTriangle;
    t[1].x() = bad;
    EXPECT_FALSE(crossing(resting(t), {0.2, 0.2, 1}, {0.2, 0.2, -1}));
  }
}

}  // namespace
}  // namespace fivepipe::collision
