// The nearest triangle of a part, against all of its triangles.
#include <gtest/gtest.h>

#include "common/collision/proximity/proximity.h"
#include "tests/support/collision/scene.h"
#include "tests/support/hull/test_pool.h"
#include "tests/support/not_finite.h"

namespace fivepipe::collision {
namespace {

using test::kInfinity;
constexpr ProximityOptions kOptions{.cap_m = 0.15, .tolerance_m = 1e-3};

Proximity nearest_of(HullProximity& proximity, const Bvh& tree, const Eigen::Isometry3d& pose) {
  const std::vector<Triangle> triangles = world_triangles(tree.mesh(), pose);
  std::vector<Proximity> each(triangles.size());
  proximity.of_triangles(triangles, each);
  Proximity nearest{kInfinity, kInfinity};
  for (const Proximity& p : each)
    nearest = {std::min(nearest.min_m, p.min_m), std::min(nearest.max_m, p.max_m)};
  return nearest;
}

Eigen::Isometry3d random_pose(test::Random& random, double extent_m) {
  Eigen::Isometry3d pose = test::at(test::random_in_ball(random, extent_m));
  pose.rotate(test::random_rotation(random, 0, 3));
  return pose;
}

TEST(PartProximity, IsThatOfTheNearestTriangle) {
  test::Random random(3);
  int near = 0, far = 0, inside = 0;
  for (int scene = 0; scene < 50; ++scene) {
    const std::vector<hull::Silhouette> silhouettes = test::silhouettes_of(
        {test::random_cameras(random, 3 + scene % 3), test::random_object(random, 3)});
    hull::CpuHull hull(test::test_pool(), silhouettes);
    const hull::HullQuery query(hull);
    HullProximity proximity(query, kOptions);
    const Bvh tree(scene % 2 ? geometry::sphere_mesh(0.06, 2)
                             : geometry::box_mesh({0.2, 0.05, 0.01}, 0.02));
    for (int i = 0; i < 5; ++i) {
      const Eigen::Isometry3d pose = random_pose(random, i % 2 ? 0.15 : 0.5);
      const Proximity part = proximity.of_part(tree, pose),
                      nearest = nearest_of(proximity, tree, pose);
      EXPECT_LE(part.min_m, nearest.max_m);
      EXPECT_GE(part.max_m, nearest.min_m);
      if (std::isfinite(part.max_m)) {
        EXPECT_LE(part.max_m - part.min_m, 2 * kOptions.tolerance_m);
        (part.max_m > 0 ? near : inside) += 1;
      } else {
        EXPECT_GE(part.min_m, kOptions.cap_m);
        EXPECT_GE(nearest.max_m, kOptions.cap_m);
        ++far;
      }
      // A bounded search returns true bounds, too.
      for (const double enough_m : {0.0, 0.02, 0.08}) {
        const Proximity bounded = proximity.of_part(tree, pose, enough_m);
        EXPECT_LE(bounded.min_m, nearest.max_m);
        EXPECT_GE(bounded.max_m, nearest.min_m);
        EXPECT_TRUE(bounded.min_m >= enough_m ||
                    bounded.max_m - bounded.min_m <= 2 * kOptions.tolerance_m)
            << bounded.min_m << ' ' << bounded.max_m << ' ' << enough_m;
      }
    }
  }
  EXPECT_GT(near, 20);
  EXPECT_GT(far, 20);
  EXPECT_GT(inside, 20);
}

TEST(PartProximity, OfNothing) {
  const std::vector<hull::Silhouette> hand = test::hand_among();
  hull::CpuHull hull(test::test_pool(), hand), empty(test::test_pool());
  const hull::HullQuery query(hull), of_empty(empty);
  const Bvh part(geometry::box_mesh({0.1, 0.1, 0.1}));
  const Eigen::Isometry3d origin = test::at(test::kOrigin);
  EXPECT_EQ(HullProximity(of_empty, kOptions).of_part(part, origin),
            (Proximity{kInfinity, kInfinity}));
  HullProximity proximity(query, kOptions);
  EXPECT_EQ(proximity.of_part(Bvh(geometry::Mesh{}), origin), (Proximity{kInfinity, kInfinity}));
  EXPECT_EQ(proximity.of_part(part, origin), (Proximity{0, 0}));
  for (const double value : {test::kNaN, test::kInfinity})
    EXPECT_EQ(proximity.of_part(part, test::at({value, 0, 0})), (Proximity{0, kInfinity}));
}

}  // namespace
}  // namespace fivepipe::collision
