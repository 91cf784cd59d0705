// Reduction of an object's collision points, which both certified backends share.
#include <algorithm>
#include <limits>
#include <map>

#include "common/collision/detection/cpu/detection_common.h"
#include "tests/support/collision/triangles.h"

namespace fivepipe::test {
namespace {

using collision::CollisionPoint;
using Eigen::Vector3d;

// Each point has its own triangle, which identifies it.
std::vector<CollisionPoint> random_points(Random& random, std::size_t count) {
  std::vector<CollisionPoint> points;
  for (std::size_t i = 0; i < count; ++i)
    points.push_back(
        {Vector3d{uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1)},
         std::uint32_t(i)});
  return points;
}

TEST(Subsample, KeepsTheFarthestPointWhereverItIs) {
  Random random(1);
  const Vector3d rp(0.3, -0.2, 0.1);
  for (std::size_t count = 2; count <= 30; ++count)
    for (std::size_t farthest = 0; farthest < count; ++farthest) {
      std::vector<CollisionPoint> all = random_points(random, count);
      all[farthest].p_world_m = rp + Vector3d(0, 3, 4);
      for (std::size_t max_points = 1; max_points < count; ++max_points) {
        std::vector<CollisionPoint> kept = all;
        EXPECT_TRUE(collision::subsample(kept, rp, max_points));
        ASSERT_EQ(kept.size(), max_points);
        EXPECT_EQ(std::count(kept.begin(), kept.end(), all[farthest]), 1)
            << farthest << " of " << count << " with " << max_points;
      }
    }
}

// Of max_points equal parts of the list, each keeps one point.
TEST(Subsample, KeepsOnePointOfEachPart) {
  Random random(2);
  for (const std::size_t count : {10u, 97u, 1000u}) {
    const std::vector<CollisionPoint> all = random_points(random, count);
    for (const std::size_t max_points : {1u, 2u, 7u, 9u}) {
      std::vector<CollisionPoint> kept = all;
      collision::subsample(kept, Vector3d::Zero(), max_points);
      for (std::size_t i = 0; i < max_points; ++i) {
        EXPECT_GE(kept[i].triangle, i * count / max_points);
        EXPECT_LT(kept[i].triangle, (i + 1) * count / max_points);
        EXPECT_EQ(kept[i], all[kept[i].triangle]);
      }
    }
  }
}

// The first of several farthest points is kept.
TEST(Subsample, KeepsTheFirstOfEquallyFarPoints) {
  const std::vector<CollisionPoint> all{{Vector3d(0.1, 0, 0), 0},
                                        {Vector3d(1, 0, 0), 1},
                                        {Vector3d(0, 1, 0), 2},
                                        {Vector3d(0, 0, 0), 3}};
  std::vector<CollisionPoint> kept = all;
  EXPECT_TRUE(collision::subsample(kept, Vector3d::Zero(), 2));
  EXPECT_EQ(kept, (std::vector<CollisionPoint>{all[1], all[2]}));
}

TEST(MaxPointsFound, GrowsWithTheOptionAndTheTriangles) {
  EXPECT_EQ(collision::max_points_found({.spacing_m = 1e-3, .max_points = 10}, 7),
            10u * 64 + 4 * 7);
  EXPECT_EQ(collision::max_points_found({.spacing_m = 1e-3, .max_points = 1}, 0), 64u);
  EXPECT_EQ(collision::max_points_found({.spacing_m = 0, .max_points = 10}, 7),
            std::numeric_limits<std::size_t>::max());
}

TEST(Subsample, LeavesAShortEnoughListAlone) {
  Random random(3);
  const std::vector<CollisionPoint> all = random_points(random, 5);
  for (const std::size_t max_points : {5u, 6u, 1000u}) {
    std::vector<CollisionPoint> kept = all;
    EXPECT_FALSE(collision::subsample(kept, Vector3d::Zero(), max_points));
    EXPECT_EQ(kept, all);
  }
  std::vector<CollisionPoint> none;
  EXPECT_FALSE(collision::subsample(none, Vector3d::Zero(), 1));
}

}  // namespace
}  // namespace fivepipe::test
