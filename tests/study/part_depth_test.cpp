// The depth of a part in a hull of which one side is known in closed form.
#include "common/study/part_depth.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "tests/support/collision/scene.h"

namespace fivepipe::study {
namespace {

using Eigen::Vector3d;

constexpr double kInfinite_m = std::numeric_limits<double>::infinity();
// Where the hull ends towards larger x: the plane through the first camera's center and the border
// between two of its columns at the principal point.
constexpr double kEnd_m = 0.1;

// A camera that looks along +y from a distance of 2 m, and one that looks down. A pixel is 3 cm at
// the origin. The hull is some 18 x 19 x 19 cm.
std::vector<hull::Silhouette> slab() {
  const geometry::Pinhole pinhole{64, 64, 64, 64, 31.5, 31.5};
  std::vector<hull::Silhouette> cameras{
      {{pinhole, geometry::look_at({kEnd_m, -2, 0}, {kEnd_m, 0, 0})}, hull::ObjectPixels(64, 64)},
      {{pinhole, geometry::look_at({0, 0, 2}, {0, 0, 0}, Vector3d::UnitY())},
       hull::ObjectPixels(64, 64)}};
  for (int v = 29; v < 35; ++v) {
    cameras[0].pixels.set_run(26, 32, v);
    cameras[1].pixels.set_run(20, 44, v);
  }
  return cameras;
}

// An edge along z at edge_m, of a bar that stands on it.
constexpr double kBar_m = 0.3;
const geometry::Mesh kBar = geometry::box_mesh({kBar_m, kBar_m, 0.6}, 0.1);
Eigen::Isometry3d bar_at(double edge_m) {
  return test::at({edge_m + kBar_m / std::numbers::sqrt2, 0, 0}) *
         Eigen::AngleAxisd(std::numbers::pi / 4, Vector3d::UnitZ());
}
// A wall, larger than the hull in y and z, whose left face is at left_m.
const Vector3d kWall_m{0.4, 0.6, 0.6};
const geometry::Mesh kWall = geometry::box_mesh(kWall_m, 0.1);
Eigen::Isometry3d wall_at(double left_m) { return test::at({left_m + 0.5 * kWall_m.x(), 0, 0}); }

Bracket depth_of(const PartDepth& depth, double spacing_m) {
  const std::vector<hull::Silhouette> silhouettes = slab();
  FrameHull hull({}, 0.5e-3);
  hull.set(silhouettes);
  EXPECT_FALSE(hull.is_empty());
  return depth(hull, spacing_m);
}

void expect_contains(const Bracket& bracket, double truth_m) {
  EXPECT_LE(bracket.min_m, truth_m + 1e-9);
  EXPECT_GE(bracket.max_m, truth_m - 1e-9);
  EXPECT_LE(bracket.max_m - bracket.min_m, 1e-3) << truth_m;
}

TEST(PartDepth, AlongAnAxisIsTheWayOutOfTheHull) {
  const collision::SpacingInterval range{-0.05, 0.3};
  // The second depth is beyond what is searched first.
  for (const double depth_m : {0.0123, 0.0789})
    for (const double spacing_m : {0.0, 0.04}) {
      const PartDepth along_x(kBar, bar_at(kEnd_m - depth_m - spacing_m), {1, 0, 0}, range);
      expect_contains(depth_of(along_x, spacing_m), depth_m);
    }
  const PartDepth oblique(kBar, bar_at(kEnd_m - 0.02), {1, 1, 0}, range);
  expect_contains(depth_of(oblique, 0), 0.02 * std::sqrt(2.0));
}

// A sweep cannot certify a face that is parallel to the border of the hull.
TEST(PartDepth, OfAParallelFaceIsBoundedByDetection) {
  for (const double depth_m : {0.0123, 0.0789}) {
    const PartDepth along_x(kWall, wall_at(kEnd_m - depth_m), {1, 0, 0}, {-0.05, 0.3}),
        without_axis(kWall, wall_at(kEnd_m - depth_m));
    for (const PartDepth* const depth : {&along_x, &without_axis}) {
      const Bracket found = depth_of(*depth, 0);
      EXPECT_GT(found.min_m, 0.3 * depth_m);
      EXPECT_LE(found.min_m, depth_m);
      EXPECT_GE(found.max_m, depth_m);
      EXPECT_LE(found.max_m, depth_m + 0.5e-3);
    }
  }
}

TEST(PartDepth, OfAPartOutOfTheHullIsZero) {
  const PartDepth along_x(kWall, wall_at(kEnd_m + 1e-3), {1, 0, 0}, {0, 0.3});
  EXPECT_EQ(depth_of(along_x, 0), (Bracket{0, 0}));
}

TEST(PartDepth, IsInfiniteIfThePartCollidesInItsWholeRange) {
  const PartDepth short_range(kWall, wall_at(kEnd_m - 0.05), {1, 0, 0}, {-0.01, 0.04});
  const Bracket found = depth_of(short_range, 0);
  EXPECT_EQ(found.max_m, kInfinite_m);
  EXPECT_EQ(found.min_m, kInfinite_m);
}

TEST(PartDepth, WithoutAnAxisIsTheShortestMoveAlongXYOrZ) {
  for (const double depth_m : {0.0123, 0.0789})
    expect_contains(depth_of(PartDepth(kBar, bar_at(kEnd_m - depth_m)), 0), depth_m);
  // A plate whose edge along x is far, so that it leaves the hull across its face.
  const Vector3d plate_m{0.9, 0.004, 0.6};
  const PartDepth plate(geometry::box_mesh(plate_m, 0.1), test::at({0, 0.03, 0}));
  const Bracket found = depth_of(plate, 0);
  EXPECT_GT(found.min_m, 0.05);
  EXPECT_LT(found.max_m, 0.09);
}

TEST(PartDepth, WithoutAnAxisIsAtLeastTheLongestMoveIfNoneFreesThePart) {
  // Walls that are nearer to each other than the hull is wide.
  const geometry::Mesh grid = [] {
    geometry::Mesh all;
    for (int i = -10; i <= 10; ++i) {
      geometry::Mesh wall = geometry::box_mesh({3, 0.02, 3}, 0.3);
      for (Vector3d& v : wall.vertices_m) v.y() += 0.1 * i;
      for (auto t : wall.triangles)
        all.triangles.push_back({t[0] + std::uint32_t(all.vertices_m.size()),
                                 t[1] + std::uint32_t(all.vertices_m.size()),
                                 t[2] + std::uint32_t(all.vertices_m.size())});
      all.vertices_m.insert(all.vertices_m.end(), wall.vertices_m.begin(), wall.vertices_m.end());
    }
    return all;
  }();
  const Bracket found = depth_of(PartDepth(grid, test::at({0, 0, 0})), 0);
  EXPECT_EQ(found.max_m, kInfinite_m);
  EXPECT_GT(found.min_m, 0.01);
  EXPECT_LE(found.min_m, kMaxMove_m + 1e-9);
}

TEST(PartDepth, RefusesARangeThatDescends) {
  EXPECT_THROW(PartDepth(kWall, wall_at(0), {1, 0, 0}, {0.2, 0.1}), std::invalid_argument);
  EXPECT_THROW(PartDepth(kWall, wall_at(0), {1, 0, 0}, {0, 2000}), std::invalid_argument);
  EXPECT_THROW(PartDepth(kWall, wall_at(0), {0, 0, 0}, {0, 1}), std::invalid_argument);
}

}  // namespace
}  // namespace fivepipe::study
