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
    const std::vector<Capsule> object = test::random_object(random, 3);
    expect_exact_extents(
        true_object_pixels(object, test::random_camera(random, 333, 241), PixelRule::center), 7);
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

// Whole words of the rows around the object, and beyond them the distance to the stored region and
// its margin.
TEST(SkipMap, StoresTheBoundsAndEightPixelsMore) {
  for (const auto& [u0, u1] :
       {std::pair{0, 1}, {7, 20}, {8, 20}, {71, 120}, {72, 120}, {72, 121}}) {
    SCOPED_TRACE(u0);
    ObjectPixels pixels(300, 60);
    for (int v = 20; v < 33; ++v) pixels.set_run(u0, u1, v);
    SkipMap map;
    map.assign(pixels);
    test::make_all(map);
    const PixelRect stored{u0 < 8    ? -64
                           : u0 < 72 ? 0
                                     : 64,
                           12,
                           u1 <= 56    ? 64
                           : u1 <= 120 ? 128
                                       : 192,
                           41};
    ASSERT_EQ(map.stored(), stored);
    EXPECT_EQ(map.bounds(), (PixelRect{u0, 20, u1, 33}));
    EXPECT_EQ(map.stride(), stored.width_px());
    EXPECT_EQ(map.box_bytes(), stored.area_px() + 64);
    for (int box = 0; box < kQuadrants; ++box) {
      EXPECT_EQ(map.bytes(Quadrant(box)) - map.bytes(Quadrant(0)),
                std::ptrdiff_t(box) * std::ptrdiff_t(map.box_bytes()));
      for (const int beyond : {1, 2, 100}) {
        EXPECT_EQ(map.at(Quadrant(box), stored.u0_px - beyond, 30), beyond + 8);
        EXPECT_EQ(map.at(Quadrant(box), stored.u1_px - 1 + beyond, 30), beyond + 8);
        EXPECT_EQ(map.at(Quadrant(box), u0, stored.v0_px - beyond), beyond + 8);
        EXPECT_EQ(map.at(Quadrant(box), u0, stored.v1_px - 1 + beyond), beyond + 8);
        EXPECT_EQ(map.at(Quadrant(box), stored.u0_px - 3, stored.v0_px - beyond),
                  std::max(beyond, 3) + 8);
      }
      for (int u = stored.u0_px; u < stored.u1_px; u += 5)
        for (int v = stored.v0_px; v < stored.v1_px; ++v)
          ASSERT_EQ(map.at(Quadrant(box), u, v),
                    map.bytes(Quadrant(box))[(v - stored.v0_px) * map.stride() + u - stored.u0_px]);
    }
  }
  EXPECT_EQ(kExtents_px, (std::array{1, 2, 3, 5, 9, 17, 33, 65}));
}

TEST(SkipMap, HasTheQuadrantsMadeSinceTheLastAssign) {
  ObjectPixels pixels(30, 20);
  pixels.set(4, 5);
  SkipMap map;
  for (int round = 0; round < 2; ++round)
    for (int made = 0; made < kQuadrants; ++made) {
      map.assign(pixels);
      map.make(Quadrant(made));
      for (int box = 0; box < kQuadrants; ++box) EXPECT_EQ(map.has(Quadrant(box)), box == made);
    }
}

TEST(SkipMap, QuadrantsAreNamedByTheirDirections) {
  EXPECT_EQ(quadrant_ahead(false, false), Quadrant::right_down);
  EXPECT_EQ(quadrant_ahead(true, false), Quadrant::left_down);
  EXPECT_EQ(quadrant_ahead(false, true), Quadrant::right_up);
  EXPECT_EQ(quadrant_ahead(true, true), Quadrant::left_up);
  for (int box = 0; box < kQuadrants; ++box)
    for (const int r : {1, 2, 5})
      EXPECT_EQ(quadrant_rect(Quadrant(box), 10, 20, r),
                pixels_of_quadrant(Quadrant(box), 10, 20, r));
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
