// Connected components of the hull.
#include <Eigen/Eigenvalues>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "common/collision/tracking/hull_components.h"
#include "tests/support/collision_scene.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

const Eigen::AlignedBox3d kSpace(Vector3d(-0.3, -0.3, -0.3), Vector3d(0.3, 0.3, 0.3));

std::vector<collision::HullComponent> components_of(
    const std::vector<hull::Silhouette>& silhouettes, double cell_m, int threads = 1,
    const Eigen::AlignedBox3d& within = kSpace) {
  base::WorkerPool pool(threads);
  hull::CpuHull hull(pool, silhouettes);
  return collision::hull_components(hull::HullQuery(hull), {within, cell_m});
}

// Many cameras on all sides: the hull is almost the object.
std::vector<geometry::Camera> all_around(int size_px = 300) {
  std::vector<geometry::Camera> cameras = ring(12, 1.5, 0.5, size_px, 0.9);
  for (const geometry::Camera& c : ring(12, 1.5, -0.4, size_px, 0.9)) cameras.push_back(c);
  for (const geometry::Camera& c : ring(8, 1.5, 1.1, size_px, 0.9)) cameras.push_back(c);
  return cameras;
}

TEST(HullComponents, MomentsEqualTheSumOverCellsInTheHull) {
  Random random(1);
  for (int scene = 0; scene < 6; ++scene) {
    const auto silhouettes = silhouettes_of(
        {{random_in_ball(random, 0.1), random_in_ball(random, 0.1), uniform(random, 0.02, 0.05)}},
        random_cameras(random, 3 + scene % 3));
    const double cell_m = 0.012;
    const auto components = components_of(silhouettes, cell_m);
    double count = 0, found = 0;
    Vector3d sum = Vector3d::Zero(), found_sum = Vector3d::Zero();
    for (int z = 0; z < 50; ++z)
      for (int y = 0; y < 50; ++y)
        for (int x = 0; x < 50; ++x) {
          const Vector3d p = kSpace.min() + cell_m * Vector3d(x + 0.5, y + 0.5, z + 0.5);
          if (!hull::in_hull(silhouettes, p)) continue;
          ++count;
          sum += p;
        }
    for (const collision::HullComponent& component : components)
      found += double(component.cells),
          found_sum += double(component.cells) * component.centroid_world_m;
    // Components of one cell are dropped.
    EXPECT_NEAR(found, count, 3 + 0.01 * count);
    if (found == count) {
      EXPECT_LT((found_sum - sum).norm() / count, 1e-9);
    }
  }
}

TEST(HullComponents, BallAndRodMomentsAreCorrect) {
  const Vector3d axis = Vector3d(1, 2, -0.5).normalized();
  const hull::Capsule rod{Vector3d(-0.1, 0, 0.05) - 0.08 * axis,
                          Vector3d(-0.1, 0, 0.05) + 0.08 * axis, 0.02};
  const auto components =
      components_of(silhouettes_of({ball({0.15, -0.05, 0}, 0.05), rod}, all_around()), 0.004);
  ASSERT_EQ(components.size(), 2u);
  const collision::HullComponent &sphere = components[0].centroid_world_m.x() > 0 ? components[0]
                                                                                  : components[1],
                                 &capsule = components[0].centroid_world_m.x() > 0 ? components[1]
                                                                                   : components[0];
  EXPECT_LT((sphere.centroid_world_m - Vector3d(0.15, -0.05, 0)).norm(), 0.002);
  EXPECT_NEAR(sphere.volume_m3, 4.0 / 3 * std::numbers::pi * 1.25e-4, 0.15 * 5.2e-4);
  EXPECT_LT((capsule.centroid_world_m - Vector3d(-0.1, 0, 0.05)).norm(), 0.002);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(capsule.covariance_world_m2);
  EXPECT_GT(std::abs(axes.eigenvectors().col(2).dot(axis)), std::cos(0.02));
  EXPECT_NEAR(std::sqrt(axes.eigenvalues()(2)), 0.2 / std::sqrt(12.0),
              0.01);  // about that of a rod of its length
  EXPECT_FALSE(sphere.clipped || capsule.clipped);
}

TEST(HullComponents, TouchingCellsFormOneComponent) {
  const auto separate =
      silhouettes_of({ball({-0.06, 0, 0}, 0.04), ball({0.06, 0, 0}, 0.04)}, all_around());
  const auto overlapping =
      silhouettes_of({ball({-0.03, 0, 0}, 0.04), ball({0.03, 0, 0}, 0.04)}, all_around());
  EXPECT_EQ(components_of(separate, 0.005).size(), 2u);
  EXPECT_EQ(components_of(overlapping, 0.005).size(), 1u);
}

TEST(HullComponents, IsClippedAtTheSearchBoxAndImageBorder) {
  const auto silhouettes = silhouettes_of({ball(kOrigin, 0.05)}, all_around());
  EXPECT_FALSE(components_of(silhouettes, 0.005)[0].clipped);
  EXPECT_TRUE(components_of(silhouettes, 0.005, 1,
                            {Vector3d(-0.3, -0.3, -0.3), Vector3d(0.01, 0.3, 0.3)})[0]
                  .clipped);
  const auto at_border = silhouettes_of({ball({0.43, 0, 0}, 0.05)}, ring(4, 1.5, 1.2, 300, 0.9));
  for (const collision::HullComponent& component :
       components_of(at_border, 0.005, 1, {Vector3d(0.2, -0.3, -0.3), Vector3d(0.8, 0.3, 0.3)}))
    EXPECT_TRUE(component.clipped);
}

TEST(HullComponents, AreIndependentOfThreads) {
  const auto silhouettes = silhouettes_of({ball({-0.06, 0, 0}, 0.04), ball({0.06, 0, 0}, 0.03)},
                                          ring(4, 1.5, 0.6, 300, 0.9));
  const auto one = components_of(silhouettes, 0.005, 1),
             three = components_of(silhouettes, 0.005, 3);
  ASSERT_EQ(one.size(), three.size());
  for (std::size_t i = 0; i < one.size(); ++i)
    EXPECT_EQ(one[i].centroid_world_m, three[i].centroid_world_m);
}

TEST(HullComponents, EmptyHullHasNoneAndInvalidArgumentsThrow) {
  EXPECT_TRUE(components_of({}, 0.005).empty());
  const auto silhouettes = silhouettes_of({ball(kOrigin, 0.05)}, ring(4, 1.5, 0.6, 300, 0.9));
  EXPECT_TRUE(
      components_of(silhouettes, 0.005, 1, {Vector3d(0.2, 0.2, 0.2), Vector3d(0.3, 0.3, 0.3)})
          .empty());
  EXPECT_THROW(components_of(silhouettes, 0), std::invalid_argument);
  EXPECT_THROW(components_of(silhouettes, 1e-6), std::invalid_argument);
  EXPECT_THROW(components_of(silhouettes, std::numeric_limits<double>::infinity()),
               std::invalid_argument);
  EXPECT_THROW(components_of(silhouettes, 0.005, 1, {}), std::invalid_argument);
  EXPECT_THROW(
      components_of(silhouettes, 0.005, 1,
                    {Vector3d(0, 0, std::numeric_limits<double>::quiet_NaN()), Vector3d(1, 1, 1)}),
      std::invalid_argument);
}

}  // namespace
}  // namespace fivepipe::test
