#include "common/collision/spacing/view_interval.h"

#include <gtest/gtest.h>

#include "tests/support/collision/scene.h"

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

const Eigen::AlignedBox3d kEverywhere = hull::HullRule{}.within_world_m;

MovablePart cube(const Vector3d& at_m, const Vector3d& axis) {
  return {geometry::box_mesh({0.1, 0.1, 0.1}), test::at(at_m), axis};
}

TEST(ViewInterval, IsThatOfTheBox) {
  const Eigen::AlignedBox3d box(Vector3d(-1, -1, -1), Vector3d(1, 2, 1));
  const auto found = interval_in_view(cube({0, 0.5, 0}, Vector3d::UnitY()), {-9, 9}, {}, box);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->low_m, -1.45, 1e-12);
  EXPECT_NEAR(found->high_m, 1.45, 1e-12);
  EXPECT_FALSE(interval_in_view(cube({3, 0, 0}, Vector3d::UnitY()), {-9, 9}, {}, box));
  const auto beside =
      interval_in_view(cube({3, 0.5, 0}, Vector3d::UnitX()).beside({-3, 0.1, 0}, Vector3d::UnitY()),
                       {-9, 9}, {}, box);
  ASSERT_TRUE(beside);
  EXPECT_NEAR(beside->low_m, -1.55, 1e-12);
  EXPECT_NEAR(beside->high_m, 1.35, 1e-12);
  EXPECT_EQ(interval_in_view(cube({3, 0, 0}, Vector3d::UnitY()), {-9, 9}, {}, kEverywhere),
            (SpacingInterval{-9, 9}));
}

// At each of many spacings, the part is in the images if each corner projects into each of them.
TEST(ViewInterval, IsWhereEachCornerIsInEachImage) {
  test::Random random(5);
  int with_view = 0, limited = 0;
  for (int scene = 0; scene < 200; ++scene) {
    const std::vector<geometry::Camera> cameras = test::random_cameras(random, 1 + scene % 4);
    const Vector3d center = test::random_in_ball(random, 0.3);
    const MovablePart part = cube(center, test::random_direction(random));
    const SpacingInterval range{-3, 3};
    const auto found = interval_in_view(part, range, cameras, kEverywhere);
    with_view += found.has_value();
    limited += found && (found->low_m > range.low_m || found->high_m < range.high_m);
    for (int i = 0; i < 100; ++i) {
      const double spacing_m = test::uniform(random, range.low_m, range.high_m);
      bool is_in_view = true;
      for (const geometry::Camera& camera : cameras)
        for (const Vector3d& vertex_m : part.tree().mesh().vertices_m) {
          const auto px = geometry::project(camera, part.pose(spacing_m) * vertex_m);
          is_in_view &= px && px->x() >= -0.5 && px->y() >= -0.5 &&
                        px->x() <= camera.pinhole.width_px - 0.5 &&
                        px->y() <= camera.pinhole.height_px - 0.5;
        }
      EXPECT_EQ(is_in_view, found && spacing_m >= found->low_m && spacing_m <= found->high_m)
          << scene << ' ' << spacing_m;
    }
  }
  EXPECT_GT(with_view, 50);
  EXPECT_GT(limited, 50);
}

}  // namespace
}  // namespace fivepipe::collision
