// Properties of every distance, and determinism.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "tests/collision/proximity/proximity_queries.h"
#include "tests/support/not_finite.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

TEST(Proximity, IsOneLipschitz) {
  const Queries q(hand());
  Random random(2);
  const auto points = random_points(random, 400, 0.15);
  const auto found = of_points(q.query, {0.05, 0.001}, points);
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t k = 0; k < points.size(); ++k)
      ASSERT_LE(found[i].min_m, found[k].max_m + (points[i] - points[k]).norm() + kRounding_m);
}

TEST(Proximity, IsMonotoneInTheNumberOfCameras) {
  Random random(3);
  const auto points = random_points(random, 400, 0.15);
  const auto three = of_points(Queries(hand(3)).query, {0.05, 0.001}, points),
             four = of_points(Queries(hand(4)).query, {0.05, 0.001}, points);
  int farther = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_LE(three[i].min_m, four[i].max_m);
    farther += four[i].min_m > three[i].max_m;
  }
  EXPECT_GT(farther, 20);
}

TEST(Proximity, ScalesWithTheUnitOfLength) {
  auto silhouettes = hand();
  Random random(4);
  auto points = random_points(random, 300, 0.15);
  const auto found = of_points(Queries(silhouettes).query, {0.05, 0.001}, points);
  constexpr double kScale = 1024;  // a power of two, so scaling is exact
  for (hull::Silhouette& s : silhouettes) s.camera.camera_from_world.translation() *= kScale;
  for (Vector3d& p : points) p *= kScale;
  const auto scaled =
      of_points(Queries(silhouettes).query, {kScale * 0.05, kScale * 0.001}, points);
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_EQ(scaled[i], (collision::Proximity{kScale * found[i].min_m, kScale * found[i].max_m}));
}

TEST(Proximity, IsInvariantUnderTranslation) {
  auto silhouettes = hand();
  Random random(5);
  auto points = random_points(random, 300, 0.15);
  const auto found = of_points(Queries(silhouettes).query, {0.05, 0.001}, points);
  Eigen::Isometry3d moved_from_world = Eigen::Isometry3d::Identity();
  moved_from_world.translate(Vector3d(900, -300, 50))
      .rotate(Eigen::AngleAxisd(1, Vector3d(1, 2, 3).normalized()));
  for (hull::Silhouette& s : silhouettes)
    s.camera.camera_from_world = s.camera.camera_from_world * moved_from_world.inverse();
  for (Vector3d& p : points) p = moved_from_world * p;
  const auto moved = of_points(Queries(silhouettes).query, {0.05, 0.001}, points);
  // The lattice of cubes has moved, so the bounds differ, but they overlap.
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_LE(moved[i].min_m, found[i].max_m + kRounding_m);
    EXPECT_LE(found[i].min_m, moved[i].max_m + kRounding_m);
    EXPECT_TRUE(is_tight(moved[i], {0.05, 0.001}));
  }
}

TEST(Proximity, DistanceIsClampedToTheCap) {
  const Queries q(hand());
  Random random(6);
  const auto points = random_points(random, 300, 0.3);
  const auto far = of_points(q.query, {0.25, 0.001}, points),
             close = of_points(q.query, {0.03, 0.001}, points);
  int beyond = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_LE(close[i].min_m, 0.03);
    if (far[i].min_m > 0.031) {
      EXPECT_EQ(close[i], (collision::Proximity{0.03, kInfinity}));
      ++beyond;
    }
    EXPECT_TRUE(is_tight(close[i], {0.03, 0.001}));
  }
  EXPECT_GT(beyond, 100);
}

TEST(Proximity, IsIndependentOfThreadsOrderAndEarlierQueries) {
  const auto silhouettes = hand();
  Random random(8);
  const auto points = random_points(random, 2000, 0.15);
  std::vector<collision::Triangle> triangles;
  for (int i = 0; i < 200; ++i) triangles.push_back(random_triangle(random, 0.15, 0.05));
  const collision::ProximityOptions options{0.05, 0.001};
  std::vector<collision::Proximity> expected(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    expected[i] =
        of_points(Queries(silhouettes).query, options, std::span(points).subspan(i, 1))[0];
  const auto expected_triangles = of_triangles(Queries(silhouettes).query, options, triangles);
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), 0);
  for (const int threads : {1, 2, 5}) {
    base::WorkerPool pool(threads);
    hull::CpuHull hull(pool, silhouettes);
    const hull::HullQuery query(hull);
    collision::HullProximity proximity(query, options);
    std::shuffle(order.begin(), order.end(), random);
    std::vector<Vector3d> shuffled;
    for (const std::size_t i : order) shuffled.push_back(points[i]);
    std::vector<collision::Proximity> found(points.size()), found_triangles(triangles.size());
    for (int again = 0; again < 2; ++again) {
      proximity.of_points(shuffled, found);
      proximity.of_triangles(triangles, found_triangles);
      for (std::size_t i = 0; i < order.size(); ++i) ASSERT_EQ(found[i], expected[order[i]]);
      ASSERT_EQ(found_triangles, expected_triangles);
    }
  }
}

}  // namespace
}  // namespace fivepipe::test
