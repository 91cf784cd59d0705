#include "sim_node/contact/support_points.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <set>

#include "tests/support/hull/scenes.h"

namespace fivepipe::sim {
namespace {

using Eigen::Vector3d;

// The cells of a block of 60 mm that is 3 mm deep in a flat hull: of its lower face, at z = 0, and
// of its sides, which are wider. The first one is in the middle of the face.
struct Cells {
  std::vector<Vector3d> points_m;
  std::vector<double> height_m;
  void add(const Vector3d& p_m) {
    points_m.push_back(p_m);
    height_m.push_back(p_m.z());
  }
};
Cells cells_of_a_block() {
  Cells cells;
  cells.add(Vector3d::Zero());
  for (int i = -14; i <= 14; ++i)
    for (int j = -14; j <= 14; ++j)
      if (i != 0 || j != 0) cells.add({0.002 * i, 0.002 * j, 0});
  for (int i = -14; i <= 14; ++i)
    for (const double side_m : {-0.03, 0.03})
      for (const double height_m : {0.001, 0.003}) {
        cells.add({side_m, 0.002 * i, height_m});
        cells.add({0.002 * i, side_m, height_m});
      }
  return cells;
}

std::set<std::size_t> as_set(const std::vector<std::size_t>& indices) {
  return {indices.begin(), indices.end()};
}

TEST(SupportPoints, ABlockStandsOnTheCornersOfItsFace) {
  const Cells cells = cells_of_a_block();
  const auto chosen = support_points(cells.points_m, cells.height_m, {4, 0.0005, 0});
  ASSERT_EQ(chosen.size(), 4u);
  for (const std::size_t i : chosen) {
    EXPECT_EQ(cells.height_m[i], 0);
    EXPECT_NEAR(std::abs(cells.points_m[i].x()), 0.028, 1e-12);
    EXPECT_NEAR(std::abs(cells.points_m[i].y()), 0.028, 1e-12);
  }
  EXPECT_EQ(as_set(chosen).size(), 4u);
}

// A block that stands on an edge: all points of the edge, then the farthest point of its face.
TEST(SupportPoints, OthersFollowThoseThatTouchFirst) {
  Cells cells;
  for (int i = 0; i <= 10; ++i)
    for (int j = 0; j <= 10; ++j) cells.add({0.002 * i, 0.002 * j, 0.001 * i});
  const auto chosen = support_points(cells.points_m, cells.height_m, {12, 0.0005, 0});
  ASSERT_EQ(chosen.size(), 12u);
  for (std::size_t k = 0; k < 11; ++k) EXPECT_EQ(cells.height_m[chosen[k]], 0) << k;
  EXPECT_NEAR(std::abs(cells.points_m[chosen[0]].y() - cells.points_m[chosen[1]].y()), 0.02, 1e-12);
  EXPECT_NEAR(cells.height_m[chosen[11]], 0.01, 1e-12);
}

TEST(SupportPoints, KeepTheirDistance) {
  const Cells cells = cells_of_a_block();
  const auto chosen = support_points(cells.points_m, cells.height_m, {1000, 0.0005, 0.01});
  EXPECT_GT(chosen.size(), 16u);
  for (const std::size_t a : chosen)
    for (const std::size_t b : chosen)
      EXPECT_TRUE(a == b || (cells.points_m[a] - cells.points_m[b]).norm() > 0.01);
  EXPECT_EQ(support_points({cells.points_m.data(), 1}, {cells.height_m.data(), 1}, {4, 0.0005, 0}),
            std::vector<std::size_t>{0});
}

TEST(SupportPoints, DoNotDependOnTheLastBits) {
  test::Random random(12);
  for (int scene = 0; scene < 100; ++scene) {
    Eigen::Isometry3d pose(Eigen::Translation3d(test::random_in_ball(random, 1)));
    pose.rotate(test::random_rotation(random, 0, 3));
    Cells cells = cells_of_a_block(), moved = cells;
    for (std::size_t i = 0; i < cells.points_m.size(); ++i) {
      cells.points_m[i] = pose * cells.points_m[i];
      moved.points_m[i] = cells.points_m[i] + test::random_in_ball(random, 1e-10);
      moved.height_m[i] += test::uniform(random, -1e-10, 1e-10);
    }
    // Many pairs of cells are 4 mm apart: rounding must not decide where the sample ends.
    for (const SupportSample& sample :
         {SupportSample{16, 0.0005, 0.002}, SupportSample{1000, 0.0005, 0.004}})
      EXPECT_EQ(support_points(cells.points_m, cells.height_m, sample),
                support_points(moved.points_m, moved.height_m, sample))
          << scene << ' ' << sample.max_points;
  }
}

TEST(SupportPoints, DoNotDependOnTheOrder) {
  const Cells cells = cells_of_a_block();
  const std::vector<Vector3d> reversed_m(cells.points_m.rbegin(), cells.points_m.rend());
  const std::vector<double> height_m(cells.height_m.rbegin(), cells.height_m.rend());
  const SupportSample sample{16, 0.0005, 0.002};
  const auto chosen = support_points(cells.points_m, cells.height_m, sample),
             of_reversed = support_points(reversed_m, height_m, sample);
  ASSERT_EQ(of_reversed.size(), chosen.size());
  for (std::size_t k = 0; k < chosen.size(); ++k)
    EXPECT_EQ(reversed_m[of_reversed[k]], cells.points_m[chosen[k]]) << k;
}

}  // namespace
}  // namespace fivepipe::sim
