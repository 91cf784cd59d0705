// The benchmark's scenes are what they say, and its rivals give what they claim: a comparison with something wrong is worth nothing.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>

#include "common/collision/bench/truth.h"
#include "common/collision/rivals/brute_force.h"
#include "tests/hull_scenes.h"

namespace fivepipe::rivals {
namespace {

using collision_bench::CollisionScene;
using Eigen::Vector3d;

// --- brute force -----------------------------------------------------------------------------------------------------

ObjectCollision by_scalar_loop(const std::vector<Triangle>& triangles, std::span<const Silhouette> silhouettes, int across) {
  ObjectCollision object;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const TriangleView view = view_of(triangles[i]);
    for (const TriangleSample& sample : triangle_samples(view, across)) {
      const Vector3d p_world_m = point_at(view, sample);
      if (!in_hull(silhouettes, p_world_m)) continue;
      object.points.push_back({p_world_m, std::uint32_t(i)});
      if (object.triangles.empty() || object.triangles.back() != i) object.triangles.push_back(std::uint32_t(i));
    }
  }
  return object;
}

std::vector<Triangle> random_triangles(test::Random& random, int count) {
  std::vector<Triangle> triangles;
  for (int i = 0; i < count; ++i) {
    const Vector3d middle = test::random_in_ball(random, 0.4);
    const double size_m = std::pow(10, test::uniform(random, -3, 0.7));  // up to 5 m: behind cameras too
    triangles.push_back({middle + test::random_in_ball(random, size_m), middle + test::random_in_ball(random, size_m), middle + test::random_in_ball(random, size_m)});
  }
  triangles[0][1] = triangles[0][0];                                    // degenerate
  triangles[1][2] = 0.5 * (triangles[1][0] + triangles[1][1]);          // collinear
  triangles[2] = {triangles[2][0], triangles[2][0], triangles[2][0]};   // a point
  return triangles;
}

TEST(BruteForce, FindsWhatAScalarLoopOverTheSameSamplesFinds) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    std::size_t points = 0;
    for (const int across : {1, 3, 10, 37}) {
      test::Random random(std::uint64_t(100 + across));
      const auto silhouettes = test::silhouettes_of(test::random_object(random, 5), test::random_cameras(random, 3));
      const std::vector<std::vector<Triangle>> objects{random_triangles(random, 150), {}, random_triangles(random, 300)};
      BruteForce brute(across);
      brute.set_silhouettes(silhouettes);
      WorkerPool one(1), three(3);
      const auto found = brute.detect(objects, one), threaded = brute.detect(objects, three);
      for (std::size_t o = 0; o < objects.size(); ++o) {
        const ObjectCollision expected = by_scalar_loop(objects[o], silhouettes, across);
        EXPECT_EQ(found[o].triangles, expected.triangles) << across;
        EXPECT_EQ(found[o].points, expected.points) << across;
        EXPECT_EQ(found[o].points, threaded[o].points);
        EXPECT_EQ(found[o].colliding(), !expected.points.empty());
        points += expected.points.size();
      }
    }
    EXPECT_GT(points, 1000u);
  }
  hwy::SetSupportedTargetsForTest(0);
}

TEST(BruteForce, SamplesLieInTheTriangleAndHalfOfTheViewportIsCovered) {
  test::Random random(7);
  for (const Triangle& t : random_triangles(random, 200)) {
    const TriangleView view = view_of(t);
    const auto samples = triangle_samples(view, 60);
    for (const TriangleSample& s : samples) EXPECT_TRUE(s.base >= 0 && s.side > 0 && s.base + s.side <= 1 + 1e-6f);
    EXPECT_NEAR(double(samples.size()), 1800, 60);  // the border's pixels, half of a row's two
  }
}

TEST(BruteForce, NothingIsInTheHullOfAnEmptyMapOrOfNoMap) {
  test::Random random(3);
  auto silhouettes = test::silhouettes_of(test::random_object(random, 5), test::random_cameras(random, 2));
  const std::vector<std::vector<Triangle>> objects{random_triangles(random, 50)};
  WorkerPool pool(1);
  BruteForce brute(10);
  brute.set_silhouettes({});
  EXPECT_FALSE(brute.detect(objects, pool)[0].colliding());
  silhouettes[1].pixels = ObjectPixels(silhouettes[1].pixels.width_px(), silhouettes[1].pixels.height_px());
  brute.set_silhouettes(silhouettes);
  EXPECT_FALSE(brute.detect(objects, pool)[0].colliding());
}

}  // namespace
}  // namespace fivepipe::rivals
