#include "common/geometry/rigid_alignment.h"

#include <gtest/gtest.h>

#include <limits>

namespace fivepipe::geometry {
namespace {

using Eigen::Vector3d;

const std::vector<Vector3d> kCorners{{0, 0, 0}, {0.3, 0, 0}, {0, 0.2, 0}, {0, 0, 0.1}};

Eigen::Isometry3d some_pose() {
  Eigen::Isometry3d pose(Eigen::AngleAxisd(2.1, Vector3d(1, -2, 0.5).normalized()));
  pose.translation() = Vector3d(0.4, -0.3, 1.1);
  return pose;
}

std::vector<Vector3d> moved(const std::vector<Vector3d>& points) {
  std::vector<Vector3d> moved;
  for (const Vector3d& p : points) moved.push_back(some_pose() * p);
  return moved;
}

TEST(AlignPoints, FindsTheMotion) {
  for (const std::size_t count : {3u, 4u}) {
    const std::vector<Vector3d> from(kCorners.begin(), kCorners.begin() + std::ptrdiff_t(count));
    const RigidAlignment found = align_points(from, moved(from));
    EXPECT_TRUE(found.to_from.isApprox(some_pose(), 1e-12));
    EXPECT_NEAR(found.rms_m, 0, 1e-12);
    EXPECT_EQ(found.residuals_m.size(), count);
  }
}

TEST(AlignPoints, ShowsTheResidual) {
  std::vector<Vector3d> measured = moved(kCorners);
  measured[2] += Vector3d(0, 0, 0.01);
  const RigidAlignment found = align_points(kCorners, measured);
  double sum_m2 = 0;
  for (std::size_t i = 0; i < kCorners.size(); ++i) {
    EXPECT_NEAR(found.residuals_m[i], (found.to_from * kCorners[i] - measured[i]).norm(), 1e-12);
    sum_m2 += found.residuals_m[i] * found.residuals_m[i];
  }
  EXPECT_NEAR(found.rms_m, std::sqrt(sum_m2 / 4), 1e-12);
  EXPECT_GT(found.rms_m, 0.001);
  EXPECT_LT(found.rms_m, 0.01);
  // No motion nearby is better.
  for (const Vector3d& axis : {Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(0, 0, 1)}) {
    double other_m2 = 0;
    for (std::size_t i = 0; i < kCorners.size(); ++i)
      other_m2 +=
          (Eigen::AngleAxisd(1e-3, axis) * found.to_from * kCorners[i] - measured[i]).squaredNorm();
    EXPECT_GT(other_m2, sum_m2);
  }
}

// A mirrored fixture has no motion onto it.
TEST(AlignPoints, DoesNotMirror) {
  std::vector<Vector3d> mirrored = kCorners;
  for (Vector3d& p : mirrored) p.x() = -p.x();
  const RigidAlignment found = align_points(kCorners, mirrored);
  EXPECT_NEAR(found.to_from.linear().determinant(), 1, 1e-12);
  EXPECT_GT(found.rms_m, 0.01);
}

TEST(AlignPoints, RefusesWhatDoesNotDetermineIt) {
  const std::vector<Vector3d> line{{0, 0, 0}, {0.1, 0, 0}, {0.3, 0, 0.001}};
  EXPECT_THROW(align_points(line, moved(line)), std::invalid_argument);
  const std::vector<Vector3d> one{{1, 1, 1}, {1, 1, 1}, {1, 1, 1}};
  EXPECT_THROW(align_points(one, one), std::invalid_argument);
  const std::vector<Vector3d> two(kCorners.begin(), kCorners.begin() + 2);
  EXPECT_THROW(align_points(two, two), std::invalid_argument);
  EXPECT_THROW(align_points(kCorners, two), std::invalid_argument);
  std::vector<Vector3d> bad = kCorners;
  bad[1].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(align_points(kCorners, bad), std::invalid_argument);
}

}  // namespace
}  // namespace fivepipe::geometry
