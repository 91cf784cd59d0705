// The skip map against the pixels of each box.
#include <gtest/gtest.h>

#include "common/hull/cpu/skip_map.h"
#include "tests/support/hull/scenes.h"

namespace fivepipe::hull {
namespace {

using namespace test;

// Returns the pixels of the box with extent r of a quadrant.
PixelRect pixels_of_quadrant(Quadrant box, int u, int v, int r) {
  switch (box) {
    case Quadrant::right_down: return {u, v, u + r, v + r};
    case Quadrant::left_down: return {u - r + 1, v, u + 1, v + r};
    case Quadrant::right_up: return {u, v - r + 1, u + r, v + 1};
    default: return {u - r + 1, v - r + 1, u + 1, v + 1};
  }
}

// Returns true if all pixels of the rectangle equal `object`. Pixels outside the image are no
// object pixels.
bool all_equal(const ObjectPixels& pixels, const PixelRect& rect, bool object) {
  for (int v = rect.v0_px; v < rect.v1_px; ++v)
    for (int u = rect.u0_px; u < rect.u1_px; ++u)
      if (pixels.contains(u, v) != object) return false;
  return true;
}

void expect_exact_extents(const ObjectPixels& pixels, int step = 1) {
  SkipMap skip_map;
  skip_map.assign(pixels);
  test::make_all(skip_map);
  ASSERT_EQ(skip_map.bounds(), pixels.bounds());
  const PixelRect& stored = skip_map.stored();
  for (int kind = 0; kind < kQuadrants; ++kind)
    for (int v = stored.v0_px - 3; v < stored.v1_px + 3; ++v)
      for (int u = stored.u0_px - 3; u < stored.u1_px + 3; u += step) {
        const Quadrant box = Quadrant(kind);
        const int r = skip_map.at(box, u, v);
        const bool object = pixels.contains(u, v),
                   in_store = intersection(stored, {u, v, u + 1, v + 1}).area_px() == 1;
        ASSERT_NE(r, 0);
        ASSERT_EQ(r < 0, object) << u << ", " << v;
        ASSERT_TRUE(all_equal(pixels, pixels_of_quadrant(box, u, v, std::abs(r)), object))
            << "box " << kind << " at " << u << ", " << v << " extent " << r;
        const auto next = std::upper_bound(kExtents_px.begin(), kExtents_px.end(), std::abs(r));
        if (in_store && next != kExtents_px.end()) {
          ASSERT_FALSE(all_equal(pixels, pixels_of_quadrant(box, u, v, *next), object))
              << "box " << kind << " at " << u << ", " << v << " extends further than " << r;
        }
      }
}

TEST(SkipMap, ExtentsAreUniformBoxesOnNoise) {
  for (const double fraction : {0.001, 0.05, 0.5, 0.95, 0.999}) {
    test::Random random(int(1000 * fraction));
    expect_exact_extents(test::random_pixels(random, 130, 40, fraction));
  }
}

TEST(SkipMap, ExtentsAreUniformBoxesOnObjects) {
  for (int seed = 1; seed <= 2; ++seed) {
    test::Random random(seed);
    expect_exact_extents(
        true_object_pixels(test::random_object(random, 3), test::random_camera(random, 333, 241),
                           PixelRule::center),
        7);
  }
}

TEST(SkipMap, ExtentsAreUniformBoxesForWidthsThatAreNoMultipleOfAWord) {
  for (const auto& [width, height] : std::vector<std::pair<int, int>>{
           {1, 1}, {1, 40}, {63, 2}, {64, 3}, {65, 9}, {7, 7}, {129, 17}, {257, 5}, {519, 11}}) {
    SCOPED_TRACE(width);
    ObjectPixels all(width, height), one(width, height);
    for (int v = 0; v < height; ++v)
      for (int u = 0; u < width; ++u) all.set(u, v);
    one.set(width - 1, height - 1);
    expect_exact_extents(all);
    expect_exact_extents(one);
  }
}

// Small extents would cost rays many steps.
TEST(SkipMap, ExtentsAreLargeInUniformRegions) {
  ObjectPixels pixels(700, 300);
  for (int v = 0; v < 300; ++v) pixels.set(0, v), pixels.set(699, v);
  SkipMap skip_map;
  skip_map.assign(pixels);
  test::make_all(skip_map);
  for (int box = 0; box < kQuadrants; ++box)
    EXPECT_EQ(skip_map.at(Quadrant(box), 350, 150), kExtents_px.back());
  for (int v = 0; v < 300; ++v)
    for (int u = 1; u < 699; ++u) pixels.set(u, v);
  skip_map.assign(pixels);
  test::make_all(skip_map);
  for (int box = 0; box < kQuadrants; ++box)
    EXPECT_EQ(skip_map.at(Quadrant(box), 350, 150), -kExtents_px.back());
}

TEST(SkipMap, IsEmptyWithoutObjectPixels) {
  for (const ObjectPixels& none : {ObjectPixels(), ObjectPixels(0, 5), ObjectPixels(90, 60)}) {
    SkipMap skip_map;
    skip_map.assign(none);
    test::make_all(skip_map);
    EXPECT_TRUE(skip_map.bounds().empty() && skip_map.stored().empty());
    for (int box = 0; box < kQuadrants; ++box) EXPECT_GT(skip_map.at(Quadrant(box), 3, 4), 0);
  }
}

TEST(SkipMap, ReuseForAnotherSizeLeavesNoTrace) {
  test::Random random(3);
  SkipMap skip_map;
  for (const int size : {200, 30, 90, 200}) {
    const ObjectPixels pixels = test::random_pixels(random, size, size / 2, 0.3);
    SkipMap fresh;
    for (SkipMap* r : {&skip_map, &fresh}) r->assign(pixels), make_all(*r);
    for (int v = 0; v < size / 2; ++v)
      for (int u = 0; u < size; ++u)
        for (int box = 0; box < kQuadrants; ++box)
          ASSERT_EQ(skip_map.at(Quadrant(box), u, v), fresh.at(Quadrant(box), u, v));
  }
}

}  // namespace
}  // namespace fivepipe::hull
