// Maps of object pixels against one flag per pixel.
#include "common/hull/object_pixels.h"

#include <gtest/gtest.h>

#include "tests/support/hull/scenes.h"
#include "tests/support/not_finite.h"

namespace fivepipe::hull {
namespace {

using namespace test;

// Widths around the borders of words, and of the four words that bounds() takes at a time.
constexpr int kWidths[] = {1, 2, 63, 64, 65, 127, 128, 129, 255, 256, 257, 300, 513, 700};

TEST(ObjectPixels, AreEmptyAtFirst) {
  for (const auto& [width, height] : {std::pair{0, 0}, {0, 3}, {3, 0}, {65, 3}}) {
    const ObjectPixels pixels(width, height);
    EXPECT_EQ(pixels.width_px(), width);
    EXPECT_EQ(pixels.height_px(), height);
    EXPECT_EQ(pixels.words_per_row(), (width + 63) / 64);
    EXPECT_EQ(pixels.words().size(), std::size_t((width + 63) / 64 * height));
    EXPECT_EQ(pixels.count(), 0u);
    EXPECT_EQ(pixels.bounds(), (PixelRect{0, 0, 0, 0}));
    EXPECT_EQ(pixels.to_bytes(), std::vector<std::uint8_t>(std::size_t(width * height), 0));
  }
  EXPECT_EQ(ObjectPixels(), ObjectPixels(0, 0));
}

TEST(ObjectPixels, EqualOneFlagPerPixel) {
  Random random(5);
  for (const int width : kWidths) {
    const int height = 5;
    ObjectPixels pixels(width, height), runs(width, height);
    std::vector<std::uint8_t> flags(std::size_t(width * height), 0);
    for (int i = 0; i < width * height; ++i) {  // sets, and sometimes clears again
      const int u = int(random() % unsigned(width)), v = int(random() % unsigned(height));
      const bool object = random() % 3 != 0;
      pixels.set(u, v, object);
      flags[std::size_t(v * width + u)] = object ? 255 : 0;
    }
    EXPECT_EQ(pixels.to_bytes(), flags);
    EXPECT_EQ(pixels.count(), std::size_t(std::count(flags.begin(), flags.end(), 255)));
    for (int v = -1; v <= height; ++v)
      for (int u = -1; u <= width; ++u) {
        const bool inside = u >= 0 && v >= 0 && u < width && v < height;
        ASSERT_EQ(pixels.contains(u, v), inside && flags[std::size_t(v * width + u)] == 255)
            << width << ": " << u << ", " << v;
      }
    for (int i = 0; i < 200; ++i) {
      const int v = int(random() % unsigned(height)), begin = int(random() % unsigned(width + 1)),
                end = begin + int(random() % unsigned(width - begin + 1));
      const bool object = random() % 2;
      int first = begin;
      while (first < end && pixels.contains(first, v) != object) ++first;
      ASSERT_EQ(pixels.find(begin, end, v, object), first) << width << ": " << begin << ", " << end;
    }
    const PixelRect whole{0, 0, width, height};
    pixels.for_each_run(whole, [&](int v, int begin, int end) { runs.set_run(begin, end, v); });
    EXPECT_EQ(runs, pixels);
  }
}

TEST(ObjectPixels, RunsAreTheLongestInTheRegion) {
  Random random(6);
  for (const double fraction : {0.1, 0.5, 0.97, 1.0}) {
    const ObjectPixels pixels = random_pixels(random, 200, 4, fraction);
    const PixelRect region{63, 1, 193, 3};
    std::vector<std::array<int, 3>> expected, found;
    for (int v = 1; v < 3; ++v)
      for (int u = 63; u < 193; ++u) {
        if (!pixels.contains(u, v)) continue;
        if (u == 63 || !pixels.contains(u - 1, v)) expected.push_back({v, u, u});
        expected.back()[2] = u + 1;
      }
    pixels.for_each_run(region, [&](int v, int begin, int end) {
      found.push_back({v, begin, end});
    });
    EXPECT_EQ(found, expected);
  }
}

TEST(ObjectPixels, SetRunSetsExactlyItsPixels) {
  for (const int begin : {0, 1, 62, 63, 64, 65, 127, 128})
    for (const int end : {0, 1, 63, 64, 65, 127, 128, 129, 192, 193, 200}) {
      if (end < begin) continue;
      ObjectPixels pixels(200, 3), expected(200, 3);
      pixels.set(2, 1), expected.set(2, 1);  // stays set
      pixels.set_run(begin, end, 1);
      for (int u = begin; u < end; ++u) expected.set(u, 1);
      ASSERT_EQ(pixels, expected) << begin << ", " << end;
    }
}

TEST(ObjectPixels, BoundsHoldEveryObjectPixelTightly) {
  Random random(7);
  for (const int width : kWidths) {
    for (int i = 0; i < 30; ++i) {
      ObjectPixels pixels(width, 9);
      PixelRect expected;
      for (int n = 1 + i % 3; n > 0; --n) {
        const int u = int(random() % unsigned(width)), v = int(random() % 9);
        pixels.set(u, v);
        expected =
            expected.empty()
                ? PixelRect{u, v, u + 1, v + 1}
                : PixelRect{std::min(expected.u0_px, u), std::min(expected.v0_px, v),
                            std::max(expected.u1_px, u + 1), std::max(expected.v1_px, v + 1)};
      }
      ASSERT_EQ(pixels.bounds(), expected) << width;
    }
    for (const auto& [u, v] : {std::pair{0, 0}, {width - 1, 0}, {0, 8}, {width - 1, 8}}) {
      ObjectPixels pixels(width, 9);
      pixels.set(u, v);
      ASSERT_EQ(pixels.bounds(), (PixelRect{u, v, u + 1, v + 1})) << width;
    }
  }
}

TEST(ObjectPixels, AreCombinedPixelByPixel) {
  Random random(8);
  const ObjectPixels a = random_pixels(random, 130, 7, 0.5), b = random_pixels(random, 130, 7, 0.5);
  ObjectPixels both = a, either = a, first = a;
  both.keep(b);
  either.add(b);
  first.remove(b);
  for (int v = 0; v < 7; ++v)
    for (int u = 0; u < 130; ++u) {
      ASSERT_EQ(both.contains(u, v), a.contains(u, v) && b.contains(u, v));
      ASSERT_EQ(either.contains(u, v), a.contains(u, v) || b.contains(u, v));
      ASSERT_EQ(first.contains(u, v), a.contains(u, v) && !b.contains(u, v));
    }
  EXPECT_EQ(a.count_common(b), both.count());
}

// The image is the union of the half-open squares of its pixels.
TEST(ObjectPixels, SquaresOfPixelsAreHalfOpen) {
  ObjectPixels pixels(4, 3);
  pixels.set(0, 0), pixels.set(2, 1), pixels.set(3, 2);
  const double below = 1 - 1e-12;
  EXPECT_TRUE(pixels.holds(-0.5, -0.5) && pixels.contains_at(-0.5, -0.5));
  EXPECT_FALSE(pixels.holds(-0.5 / below, 0) || pixels.holds(0, -0.5 / below));
  EXPECT_TRUE(pixels.holds(3.5 * below, 2.5 * below));
  EXPECT_TRUE(pixels.contains_at(3.5 * below, 2.5 * below));
  EXPECT_FALSE(pixels.holds(3.5, 0) || pixels.holds(0, 2.5));
  EXPECT_FALSE(pixels.contains_at(3.5, 2) || pixels.contains_at(3, 2.5));
  EXPECT_TRUE(pixels.contains_at(1.5, 0.5) && pixels.contains_at(2.5 * below, 1.5 * below));
  EXPECT_FALSE(pixels.contains_at(1.5 * below, 1) || pixels.contains_at(2.5, 1) ||
               pixels.contains_at(2, 0.5 * below) || pixels.contains_at(2, 1.5));
  EXPECT_FALSE(pixels.holds(kNaN, 0) || pixels.holds(0, kNaN) || pixels.contains_at(kNaN, 0));
}

TEST(PixelRect, SizesAreThoseOfAHalfOpenRectangle) {
  const PixelRect rect{2, 3, 7, 5};
  EXPECT_EQ(rect.width_px(), 5);
  EXPECT_EQ(rect.height_px(), 2);
  EXPECT_EQ(rect.area_px(), 10u);
  EXPECT_FALSE(rect.empty());
  EXPECT_FALSE((PixelRect{0, 0, 1, 1}).empty());
  for (const PixelRect& none :
       {PixelRect{}, {2, 3, 2, 5}, {2, 3, 7, 3}, {4, 3, 3, 5}, {2, 4, 3, 2}}) {
    EXPECT_TRUE(none.empty());
    EXPECT_EQ(none.area_px(), 0u);
  }
  EXPECT_EQ((PixelRect{4, 3, 3, 5}).width_px(), 0);
  EXPECT_EQ((PixelRect{4, 5, 7, 3}).height_px(), 0);
}

TEST(PixelRect, IntersectionHoldsThePixelsOfBoth) {
  const PixelRect a{0, 10, 20, 30}, b{5, 5, 40, 25};
  EXPECT_EQ(intersection(a, b), (PixelRect{5, 10, 20, 25}));
  EXPECT_EQ(intersection(b, a), (PixelRect{5, 10, 20, 25}));
  EXPECT_EQ(intersection(a, {5, 12, 6, 13}), (PixelRect{5, 12, 6, 13}));
  EXPECT_TRUE(intersection(a, {20, 10, 30, 30}).empty());
  EXPECT_TRUE(intersection(a, {0, 30, 20, 40}).empty());
}

}  // namespace
}  // namespace fivepipe::hull
