// Segmentation at the ends of its ranges: images without pixels, no noise, black and white.
#include <random>

#include "tests/support/capture/capture_rig.h"

namespace fivepipe::capture {
namespace {

hull::ObjectPixels pixels_of_seed(int width_px, int height_px, unsigned seed) {
  std::mt19937 random(seed);
  hull::ObjectPixels pixels(width_px, height_px);
  for (int v = 0; v < height_px; ++v)
    for (int u = 0; u < width_px; ++u) pixels.set(u, v, random() % 3 != 0);
  return pixels;
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

// Also at 0 and 255, where the tolerance cannot extend beyond the range.
TEST(Difference, WithoutNoiseOnlyTheMeanIsTheEmptyScene) {
  for (const int width : {3, 16, 20})
    for (const int mean : {0, 1, 127, 254, 255}) {
      ReferenceImage reference{width, 1, {}, {}};
      reference.mean_levels.assign(std::size_t(3 * width), float(mean));
      reference.sigma_levels.assign(std::size_t(3 * width), 0.0f);
      const DifferenceTables tables = difference_tables(reference, 6, 0);
      for (int level = 0; level < 256; ++level) {
        const Difference found =
            difference(cv::Mat(1, width, CV_8UC3, cv::Scalar::all(level)), tables);
        ASSERT_EQ(found.differs.count(), level == mean ? 0u : unsigned(width)) << level << mean;
        ASSERT_EQ(found.darker.count(), level < mean ? unsigned(width) : 0u) << level << mean;
      }
    }
}

// Segments one row of equal pixels on a room of one colour. Returns true if they are object.
bool is_object(const cv::Vec3f& room_bgr, const cv::Vec3b& pixel_bgr, double min_brightness) {
  constexpr int kWidth_px = 20;
  ReferenceImage reference{kWidth_px, 1, {}, std::vector<float>(3 * kWidth_px, 1.0f)};
  for (int u = 0; u < kWidth_px; ++u)
    for (int c = 0; c < 3; ++c) reference.mean_levels.push_back(room_bgr[c]);
  config::SegmentationConfig config;
  config.shadow_min_brightness = min_brightness;
  config.opening_px = 0;
  const Segmenter segmenter(test::table_camera("any", {0, -1, 1}, kWidth_px, 1), reference, config);
  const std::size_t count =
      segmenter.segment(cv::Mat(1, kWidth_px, CV_8UC3, cv::Scalar(pixel_bgr)))->count();
  EXPECT_TRUE(count == 0 || count == kWidth_px) << count;
  return count > 0;
}

// The pixel is darker in one channel and has 1.01 times the room's brightness.
TEST(Segmentation, NothingIsShadowIfSuppressionIsOff) {
  EXPECT_FALSE(is_object({50, 200, 200}, {34, 205, 205}, 0.99));
  EXPECT_TRUE(is_object({50, 200, 200}, {34, 205, 205}, 1));
}

// Exactly half the brightness of the rounded room. A blue level of 1 would make it less than half.
TEST(Segmentation, ShadowIsComparedWithTheRoomRoundedToALevel) {
  EXPECT_FALSE(is_object({0.4f, 200, 200}, {0, 100, 100}, 0.5));
  EXPECT_TRUE(is_object({0.6f, 200, 200}, {0, 100, 100}, 0.5));
  EXPECT_FALSE(is_object({0, 254.6f, 0}, {0, 204, 0}, 0.8));  // 255 * 0.8
  EXPECT_TRUE(is_object({0, 254.6f, 0}, {0, 203, 0}, 0.8));
}

}  // namespace
}  // namespace fivepipe::capture
