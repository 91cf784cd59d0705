// Morphology, neighbourhoods and connected regions of packed object pixels.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "capture_node/segmentation/bit_morphology.h"
#include "capture_node/segmentation/components.h"

namespace fivepipe::capture {
namespace {

hull::ObjectPixels random_pixels(int width_px, int height_px, double fraction, unsigned seed) {
  std::mt19937 random(seed);
  hull::ObjectPixels pixels(width_px, height_px);
  for (int v = 0; v < height_px; ++v)
    for (int u = 0; u < width_px; ++u) pixels.set(u, v, double(random()) < fraction * 4294967296.0);
  return pixels;
}

hull::ObjectPixels pixels_of_seed(int width_px, int height_px, unsigned seed) {
  std::mt19937 random(seed);
  hull::ObjectPixels pixels(width_px, height_px);
  for (int v = 0; v < height_px; ++v)
    for (int u = 0; u < width_px; ++u) pixels.set(u, v, random() % 3 != 0);
  return pixels;
}

TEST(BitMorphology, MatchesPixelByPixelReference) {
  for (const int width : {1, 2, 7, 63, 64, 65, 128, 130})
    for (const int height : {1, 2, 9}) {
      const hull::ObjectPixels pixels =
          random_pixels(width, height, 0.7, unsigned(width * 100 + height));
      hull::ObjectPixels smaller(width, height), larger(width, height);
      for (int v = 0; v < height; ++v)
        for (int u = 0; u < width; ++u) {
          bool all = true, any = false;
          for (int y = std::max(0, v - 1); y <= std::min(height - 1, v + 1); ++y)
            for (int x = std::max(0, u - 1); x <= std::min(width - 1, u + 1); ++x) {
              all = all && pixels.contains(x, y);
              any = any || pixels.contains(x, y);
            }
          smaller.set(u, v, all);
          larger.set(u, v, any);
        }
      EXPECT_EQ(eroded(pixels, 1), smaller) << width << "x" << height;
      EXPECT_EQ(dilated(pixels, 1), larger) << width << "x" << height;
    }
  EXPECT_EQ(opened(hull::ObjectPixels(0, 0), 2), hull::ObjectPixels(0, 0));
}

TEST(BitMorphology, ImagesWithoutPixelsStayEmpty) {
  for (const auto& [width, height] : {std::pair{0, 0}, {0, 3}, {3, 0}, {130, 0}}) {
    const hull::ObjectPixels none(width, height);
    for (const auto step : {eroded, dilated, opened, closed}) EXPECT_EQ(step(none, 2), none);
  }
}

TEST(BitMorphology, RadiusIsTheNumberOfPixelsOnEachSideAndMayBeZero) {
  const hull::ObjectPixels pixels = pixels_of_seed(70, 9, 3);
  for (const int radius : {-1, 0})
    for (const auto step : {eroded, dilated, opened, closed})
      EXPECT_EQ(step(pixels, radius), pixels) << radius;
  hull::ObjectPixels one(150, 40), hole(150, 40);
  for (int v = 0; v < 40; ++v) hole.set_run(0, 150, v);
  one.set(66, 20), hole.set(66, 20, false);
  for (const int radius : {1, 2, 3}) {
    hull::ObjectPixels square(150, 40), rest = hole;
    for (int v = 20 - radius; v <= 20 + radius; ++v)
      for (int u = 66 - radius; u <= 66 + radius; ++u) square.set(u, v), rest.set(u, v, false);
    EXPECT_EQ(dilated(one, radius), square) << radius;
    EXPECT_EQ(eroded(hole, radius), rest) << radius;
    EXPECT_EQ(opened(square, radius), square) << radius;
    EXPECT_EQ(opened(square, radius + 1).count(), 0u) << radius;
    EXPECT_EQ(closed(hole, radius).count(), 150u * 40) << radius;
  }
}

TEST(Neighbourhood, CountsMatchAPixelByPixelReference) {
  for (const int width : {1, 2, 63, 64, 65, 130})
    for (const int height : {1, 2, 7})
      for (const double fraction : {0.2, 0.5, 0.9}) {
        const hull::ObjectPixels pixels =
            random_pixels(width, height, fraction, unsigned(width * 10 + height));
        for (int count = 1; count <= 9; ++count) {
          hull::ObjectPixels expected(width, height);
          for (int v = 0; v < height; ++v)
            for (int u = 0; u < width; ++u) {
              int set = 0;
              for (int y = v - 1; y <= v + 1; ++y)
                for (int x = u - 1; x <= u + 1; ++x) set += pixels.contains(x, y);
              expected.set(u, v, set >= count);
            }
          ASSERT_EQ(with_neighbours(pixels, count), expected)
              << width << 'x' << height << ", " << count;
        }
      }
  EXPECT_EQ(with_neighbours(hull::ObjectPixels(0, 0), 1), hull::ObjectPixels(0, 0));
  EXPECT_EQ(with_neighbours(hull::ObjectPixels(0, 5), 1), hull::ObjectPixels(0, 5));
}

// Labels by flood fill. Returns the pixels of each region whose pixels are `object`.
std::vector<std::vector<std::pair<int, int>>> regions(const hull::ObjectPixels& pixels, bool object,
                                                      bool diagonal) {
  const int width = pixels.width_px(), height = pixels.height_px();
  hull::ObjectPixels seen(width, height);
  std::vector<std::vector<std::pair<int, int>>> all;
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) {
      if (pixels.contains(u, v) != object || seen.contains(u, v)) continue;
      auto& region = all.emplace_back();
      region.emplace_back(u, v);
      seen.set(u, v);
      for (std::size_t i = 0; i < region.size(); ++i)
        for (int dy = -1; dy <= 1; ++dy)
          for (int dx = -1; dx <= 1; ++dx) {
            const int x = region[i].first + dx, y = region[i].second + dy;
            if ((!diagonal && dx != 0 && dy != 0) || x < 0 || y < 0 || x >= width || y >= height ||
                pixels.contains(x, y) != object || seen.contains(x, y))
              continue;
            seen.set(x, y);
            region.emplace_back(x, y);
          }
    }
  return all;
}

TEST(Components, MatchAFloodFill) {
  for (const int width : {1, 5, 63, 64, 65, 128, 131})
    for (const int height : {1, 2, 17})
      for (const double fraction : {0.3, 0.45, 0.6, 0.8}) {
        const auto seed = unsigned(width * 100 + height);
        const hull::ObjectPixels pixels = random_pixels(width, height, fraction, seed),
                                 seeds = random_pixels(width, height, 0.05, seed + 1);
        for (const int min_area_px : {0, 1, 4, 20}) {
          hull::ObjectPixels expected(width, height);
          for (const auto& region : regions(pixels, true, true)) {
            const bool has_seed = std::any_of(region.begin(), region.end(), [&](auto at) {
              return seeds.contains(at.first, at.second);
            });
            if (has_seed && int(region.size()) >= min_area_px)
              for (const auto& [u, v] : region) expected.set(u, v);
          }
          ASSERT_EQ(seeded_components(pixels, seeds, min_area_px), expected)
              << width << 'x' << height << ", " << fraction << ", area " << min_area_px;
        }
      }
  EXPECT_EQ(seeded_components({}, {}, 1), hull::ObjectPixels());
}

TEST(Components, HolesMatchAFloodFill) {
  for (const int width : {1, 3, 63, 64, 65, 128, 131})
    for (const int height : {1, 2, 3, 17})
      for (const double fraction : {0.4, 0.6, 0.75, 0.9}) {
        const hull::ObjectPixels pixels =
            random_pixels(width, height, fraction, unsigned(width * 100 + height));
        for (const int max_area_px : {0, 1, 3, 40, 100'000}) {
          hull::ObjectPixels expected = pixels;
          for (const auto& region : regions(pixels, false, false)) {
            const bool is_open = std::any_of(region.begin(), region.end(), [&](auto at) {
              return at.first == 0 || at.second == 0 || at.first == width - 1 ||
                     at.second == height - 1;
            });
            if (!is_open && int(region.size()) <= max_area_px)
              for (const auto& [u, v] : region) expected.set(u, v);
          }
          ASSERT_EQ(with_holes_filled(pixels, max_area_px), expected)
              << width << 'x' << height << ", " << fraction << ", area " << max_area_px;
        }
      }
  EXPECT_EQ(with_holes_filled({}, 5), hull::ObjectPixels());
}

// A spiral is one region, although most of its runs meet only at its end.
TEST(Components, ASpiralIsOneRegion) {
  hull::ObjectPixels spiral(130, 41), seed(130, 41);
  int left = 0, right = 129, top = 0, bottom = 40;
  for (; left < right && top < bottom; left += 2, right -= 2, top += 2, bottom -= 2) {
    spiral.set_run(left, right + 1, top);
    for (int v = top; v <= bottom; ++v) spiral.set(right, v);
    spiral.set_run(left, right + 1, bottom);
    for (int v = top + 2; v <= bottom; ++v) spiral.set(left, v);
    if (left + 2 < right && top + 2 < bottom) spiral.set(left + 1, top + 2);
  }
  seed.set(0, 0);
  const std::size_t parts = regions(spiral, true, true).size();
  ASSERT_EQ(parts, 1u);
  EXPECT_EQ(seeded_components(spiral, seed, int(spiral.count())), spiral);
  EXPECT_EQ(seeded_components(spiral, seed, int(spiral.count()) + 1).count(), 0u);
}

}  // namespace
}  // namespace fivepipe::capture
