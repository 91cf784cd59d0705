#include "common/geometry/oriented_box.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>
#include <random>

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;
using geometry::OrientedBox;
using geometry::overlap_m;

OrientedBox box(const Vector3d& center_m, const Vector3d& half_m,
                const Eigen::Matrix3d& rotation = Eigen::Matrix3d::Identity()) {
  OrientedBox result{Eigen::Isometry3d::Identity(), half_m};
  result.world_from_box.linear() = rotation;
  result.world_from_box.translation() = center_m;
  return result;
}

Eigen::Matrix3d turned(double angle_rad, const Vector3d& axis) {
  return Eigen::AngleAxisd(angle_rad, axis.normalized()).toRotationMatrix();
}

TEST(OrientedBoxes, OverlapByTheShortestTranslation) {
  const OrientedBox unit = box(Vector3d::Zero(), {1, 1, 1});
  EXPECT_NEAR(overlap_m(unit, box({1.75, 0.1, 0.2}, {1, 1, 1})), 0.25, 1e-12);
  EXPECT_NEAR(overlap_m(unit, box({0.1, -1.9, 0.2}, {1, 1, 1})), 0.1, 1e-12);
  EXPECT_EQ(overlap_m(unit, box({2.01, 0, 0}, {1, 1, 1})), 0);
  EXPECT_NEAR(overlap_m(unit, box({2, 0, 0}, {1, 1, 1})), 0, 1e-15) << "they touch";
  EXPECT_NEAR(overlap_m(unit, box(Vector3d::Zero(), {0.1, 0.2, 0.3})), 1.1, 1e-12) << "inside";
}

// A corner of the turned box points at a face of the other.
TEST(OrientedBoxes, CornerAgainstFace) {
  const Eigen::Matrix3d quarter = turned(std::numbers::pi / 4, Vector3d::UnitZ());
  const double corner_m = std::sqrt(2.0);
  EXPECT_NEAR(overlap_m(box(Vector3d::Zero(), {1, 1, 1}),
                        box({1 + corner_m - 0.125, 0, 0}, {1, 1, 1}, quarter)),
              0.125, 1e-12);
  EXPECT_EQ(overlap_m(box(Vector3d::Zero(), {1, 1, 1}),
                      box({1 + corner_m + 0.001, 0, 0}, {1, 1, 1}, quarter)),
            0);
}

// Two edges cross at a right angle: only the edges' cross product separates the boxes.
TEST(OrientedBoxes, EdgeAgainstEdge) {
  const Eigen::Matrix3d up = turned(std::numbers::pi / 4, Vector3d::UnitX()),
                        across = turned(std::numbers::pi / 4, Vector3d::UnitY());
  const double edges_m = 2 * std::sqrt(2.0);
  EXPECT_NEAR(overlap_m(box(Vector3d::Zero(), {5, 1, 1}, up),
                        box({0, 0, edges_m - 0.03125}, {1, 5, 1}, across)),
              0.03125, 1e-12);
  EXPECT_EQ(overlap_m(box(Vector3d::Zero(), {5, 1, 1}, up),
                      box({0, 0, edges_m + 0.001}, {1, 5, 1}, across)),
            0);
}

// A translation by the overlap along some direction separates them; a point in both proves that
// they overlap, and both orders give the same.
TEST(OrientedBoxes, AgreeWithSampledPoints) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto vector = [&] { return Vector3d{unit(random), unit(random), unit(random)}; };
  const auto any_box = [&](double reach) {
    const Vector3d center = reach * vector(), half = vector().cwiseAbs() + Vector3d::Constant(0.1);
    const double angle = 3 * unit(random);
    return box(center, half, turned(angle, vector()));
  };
  int overlapping = 0, apart = 0;
  for (int i = 0; i < 2000; ++i) {
    const OrientedBox a = any_box(1), b = any_box(2);
    const double overlap = overlap_m(a, b);
    EXPECT_NEAR(overlap, overlap_m(b, a), 1e-12);
    bool has_common_point = false;
    for (int k = 0; k < 200 && !has_common_point; ++k) {
      const Vector3d p = a.world_from_box * a.half_m.cwiseProduct(vector());
      has_common_point = ((b.world_from_box.inverse() * p).cwiseAbs() - b.half_m).maxCoeff() < 0;
    }
    if (has_common_point) {
      EXPECT_GT(overlap, 0) << i;
    }
    overlapping += has_common_point;
    apart += overlap == 0;
  }
  EXPECT_GT(overlapping, 300);
  EXPECT_GT(apart, 300);
}

TEST(OrientedBoxes, ThatAreNotFiniteOverlapWithoutEnd) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const OrientedBox unit = box(Vector3d::Zero(), {1, 1, 1});
  EXPECT_EQ(overlap_m(unit, box({nan, 0, 0}, {1, 1, 1})), std::numeric_limits<double>::infinity());
  EXPECT_EQ(overlap_m(box({9, 0, 0}, {1, nan, 1}), unit), std::numeric_limits<double>::infinity());
}

TEST(OrientedBoxes, ARayEntersWhereItFirstMeetsTheBox) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto vector = [&] { return Vector3d{unit(random), unit(random), unit(random)}; };
  for (int i = 0; i < 2000; ++i) {
    const Vector3d center = vector(), half = vector().cwiseAbs() + Vector3d::Constant(0.1);
    const double angle = 3 * unit(random);
    const OrientedBox box = test::box(center, half, turned(angle, vector()));
    const Vector3d inside = box.world_from_box * (0.99 * box.half_m.cwiseProduct(vector())),
                   direction = vector() + Vector3d(1.5, 0, 0);
    EXPECT_EQ(ray_entry(box, {inside, direction}), 0.0);
    const Vector3d origin = inside - 10 * direction.normalized();
    const auto entry = ray_entry(box, {origin, direction});
    ASSERT_TRUE(entry);
    // On a face.
    const Vector3d at =
        (box.world_from_box.inverse() * (origin + *entry * direction)).cwiseQuotient(box.half_m);
    EXPECT_NEAR(at.cwiseAbs().maxCoeff(), 1, 1e-9);
    EXPECT_FALSE(ray_entry(box, {origin, -direction})) << "behind the origin";
    // Beside the box: across the direction by more than its diagonal.
    const Vector3d beside = 2.01 * box.half_m.norm() * direction.unitOrthogonal();
    EXPECT_FALSE(ray_entry(box, {origin + beside, direction}));
  }
}

TEST(OrientedBoxes, ARayAlongAFaceMeetsTheClosedBox) {
  const OrientedBox box{Eigen::Isometry3d::Identity(), Vector3d(1, 2, 3)};
  EXPECT_EQ(ray_entry(box, {{1, 0, -5}, {0, 0, 1}}), 2.0);
  EXPECT_EQ(ray_entry(box, {{1, 2, -5}, {0, 0, 2}}), 1.0) << "along an edge";
  EXPECT_FALSE(ray_entry(box, {{1.000001, 0, -5}, {0, 0, 1}}));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(ray_entry(box, {{nan, 0, -5}, {0, 0, 1}}));
  EXPECT_FALSE(ray_entry(box, {{0, 0, -5}, {0, nan, 1}}));
}

}  // namespace
}  // namespace fivepipe::test
