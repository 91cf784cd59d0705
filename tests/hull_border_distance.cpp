// The skipping structure's promises, held against every pixel around.
#include <gtest/gtest.h>

#include "common/hull/border_distance.h"
#include "tests/hull_scenes.h"

namespace fivepipe {
namespace {

using namespace test;

constexpr int kExactUpTo_px = 8;

// Chessboard distance to the nearest pixel of the other kind; what is outside the image is no object pixel. `limit` where none is nearer.
int true_distance(const ObjectPixels& pixels, int u, int v, int limit) {
  const bool object = pixels.contains(u, v);
  for (int r = 1; r < limit; ++r)
    for (int d = -r; d <= r; ++d)
      if (pixels.contains(u + d, v - r) != object || pixels.contains(u + d, v + r) != object || pixels.contains(u - r, v + d) != object || pixels.contains(u + r, v + d) != object) return r;
  return limit;
}

void expect_promises_kept(const ObjectPixels& pixels, int step = 1) {
  const BorderDistance border(pixels);
  ASSERT_EQ(border.bounds(), pixels.bounds());
  const PixelRect& stored = border.stored();
  for (int v = stored.v0_px - 3; v < stored.v1_px + 3; ++v)
    for (int u = stored.u0_px - 3; u < stored.u1_px + 3; u += step) {
      const int r = border.anywhere(u, v), truth = true_distance(pixels, u, v, BorderDistance::kMost_px);
      ASSERT_EQ(r < 0, pixels.contains(u, v)) << u << ", " << v;
      ASSERT_NE(r, 0);
      ASSERT_LE(std::abs(r), truth) << u << ", " << v;
      if (truth <= kExactUpTo_px && intersection(stored, {u, v, u + 1, v + 1}).area_px() == 1) ASSERT_EQ(std::abs(r), truth) << u << ", " << v;
    }
}

TEST(BorderDistance, KeepsItsPromisesOnNoise) {
  for (const double fraction : {0.001, 0.05, 0.5, 0.95, 0.999}) {
    Random random(int(1000 * fraction));
    expect_promises_kept(random_pixels(random, 150, 70, fraction));
  }
}

TEST(BorderDistance, KeepsItsPromisesOnObjects) {
  for (int seed = 1; seed <= 4; ++seed) {
    Random random(seed);
    expect_promises_kept(true_object_pixels(random_object(random, 3), random_camera(random, 333, 241), PixelRule::centre), 3);
  }
}

TEST(BorderDistance, SizesThatAreNoMultipleOfAWord) {
  for (const auto& [width, height] : std::vector<std::pair<int, int>>{{1, 1}, {1, 40}, {63, 2}, {64, 3}, {65, 9}, {7, 7}, {129, 17}, {257, 5}, {519, 11}}) {
    SCOPED_TRACE(width);
    ObjectPixels all(width, height), one(width, height);
    for (int v = 0; v < height; ++v)
      for (int u = 0; u < width; ++u) all.set(u, v);
    one.set(width - 1, height - 1);
    expect_promises_kept(all);
    expect_promises_kept(one);
  }
}

TEST(BorderDistance, ReachesFarWhereThereIsRoom) {  // or rays would crawl
  ObjectPixels pixels(700, 300);
  for (int v = 0; v < 300; ++v) pixels.set(0, v), pixels.set(699, v);
  EXPECT_GE(BorderDistance(pixels).at(350, 150), 100);
  for (int v = 0; v < 300; ++v)
    for (int u = 1; u < 699; ++u) pixels.set(u, v);
  EXPECT_LE(BorderDistance(pixels).at(350, 150), -100);
}

TEST(BorderDistance, NoObjectPixel) {
  for (const ObjectPixels& none : {ObjectPixels(), ObjectPixels(0, 5), ObjectPixels(90, 60)}) {
    const BorderDistance border(none);
    EXPECT_TRUE(border.bounds().empty() && border.stored().empty());
    EXPECT_GT(border.anywhere(3, 4), 0);
  }
}

TEST(BorderDistance, MemoryIsReusedAcrossSizes) {
  Random random(3);
  BorderDistance border;
  for (const int size : {200, 30, 90, 200}) {
    const ObjectPixels pixels = random_pixels(random, size, size / 2, 0.3);
    border.assign(pixels);
    const BorderDistance fresh(pixels);
    for (int v = 0; v < size / 2; ++v)
      for (int u = 0; u < size; ++u) ASSERT_EQ(border.at(u, v), fresh.at(u, v));
  }
}

}  // namespace
}  // namespace fivepipe
