// Classification of pixels against the background, compared with scalar code.
#include <gtest/gtest.h>

#include <hwy/targets.h>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "capture_node/segmentation/difference.h"
#include "tests/support/capture/random_image.h"

namespace fivepipe::capture {
namespace {

using test::random_image;

Background uniform_background(int width, int height, float mean, float sigma) {
  const auto elements = std::size_t(3 * width * height);
  return {
      width, height, std::vector<float>(elements, mean), std::vector<float>(elements, sigma), {}};
}

Background background_of(const cv::Mat& mean, float sigma) {
  Background background = uniform_background(mean.cols, mean.rows, 0, sigma);
  std::copy(mean.data, mean.data + background.mean_levels.size(), background.mean_levels.begin());
  return background;
}

Tolerances plain(double sigmas, double floor_levels) { return {sigmas, floor_levels, 255, 0, 2}; }

Difference differences(const cv::Mat& image, const Background& background,
                       const Tolerances& tolerances, const DifferenceRequest& request = {}) {
  return difference(image, difference_tables(background, tolerances), request);
}

// The definition of shadow, in the float arithmetic of the product.
bool looks_like_shadow(const std::uint8_t* pixel_bgr, const std::uint8_t* background_bgr,
                       const DifferenceRequest& request) {
  int xr = 0, rr = 0, xx = 0;
  for (int c = 0; c < 3; ++c) {
    xr += pixel_bgr[c] * background_bgr[c];
    rr += background_bgr[c] * background_bgr[c];
    xx += pixel_bgr[c] * pixel_bgr[c];
  }
  if (!(float(xr) >= float(request.shadow_min_brightness) * float(rr))) return false;
  const float along = float(xr) / float(std::max(rr, 1)) * float(xr);  // (s|r|)^2
  const auto tint = float(std::tan(request.shadow_tint_degrees * std::numbers::pi / 180));
  const float max_squared_distortion =
      std::max(kShadowColour_levels * kShadowColour_levels, tint * tint * along);
  return float(xx) - along <= max_squared_distortion;
}

// Every part of the classification, for widths around the sizes of words and vectors.
TEST(Difference, MatchesAPixelByPixelReferenceAtAnyWidth) {
  for (const int width : {1, 5, 15, 16, 17, 33, 63, 64, 65, 71, 128, 645}) {
    const int height = 4;
    const cv::Mat mean = random_image(width, height, 1);
    cv::Mat image = random_image(width, height, 2);
    for (int i = 0; i < 3 * width * height; ++i)  // half of the pixels are near the background
      if (i / 3 % 2 == 0)
        image.data[i] = cv::saturate_cast<std::uint8_t>(0.75 * mean.data[i] + image.data[i] % 9);
    const InverseGain inverse_gain = inverse_of({1.1, 0.9, 1.0});
    for (const InverseGain& inverse : {kNoGain, inverse_gain}) {
      const DifferenceRequest request{inverse, 0.6, 5, nullptr};
      const Difference found =
          differences(image, background_of(mean, 9), {3, 12, 255, 0, 2.5}, request);
      for (int v = 0; v < height; ++v)
        for (int u = 0; u < width; ++u) {
          const cv::Vec3b &raw = image.at<cv::Vec3b>(v, u), &room = mean.at<cv::Vec3b>(v, u);
          std::uint8_t level[3];
          int excess = 0;
          bool above = false;
          for (int c = 0; c < 3; ++c) {
            level[c] = compensated(raw[c], inverse[std::size_t(c)]);
            // 3 sigmas of 9 levels
            const int low = std::max(0, room[c] - 27), high = std::min(255, room[c] + 27);
            above |= level[c] > high;
            excess = std::max({excess, level[c] - high, raw[c] == 255 ? 0 : low - level[c]});
          }
          const bool differs = excess > 0;
          ASSERT_EQ(found.differs.contains(u, v), differs) << width << ": " << u << ' ' << v;
          ASSERT_EQ(found.strongly.contains(u, v), excess > 40) << u << ' ' << v;  // 1.5 * 27
          ASSERT_EQ(found.shadow.contains(u, v),
                    differs && !above && looks_like_shadow(level, &room[0], request))
              << width << ": " << u << ' ' << v;
        }
      if (width > 60) {
        EXPECT_GT(found.shadow.count(), 10u);
        EXPECT_GT(found.strongly.count(), 10u);
      }
    }
  }
}

TEST(Difference, IsTheSameWithEveryInstructionSet) {
  const cv::Mat mean = random_image(645, 20, 5);
  cv::Mat image = random_image(645, 20, 6);
  for (int i = 0; i < 3 * 645 * 20; ++i)
    if (i / 3 % 2 == 0) image.data[i] = std::uint8_t(0.75 * mean.data[i] + image.data[i] % 9);
  Background background = background_of(mean, 5);
  for (int i = 0; i < 645 * 20; i += 3)
    background.moving.push_back({i, {{{0, 0, 0}, {90, 200, 255}}}});
  std::vector<Difference> found;
  hwy::SetSupportedTargetsForTest(0);
  for (std::int64_t left = hwy::SupportedTargets(); left != 0; left &= left - 1) {
    hwy::SetSupportedTargetsForTest(left & -left);
    found.push_back(differences(image, background, {3, 8, 16, 0.2, 2},
                                {inverse_of({1.1, 0.9, 1.05}), 0.5, 2, nullptr}));
  }
  hwy::SetSupportedTargetsForTest(0);
  for (const Difference& other : found) {
    EXPECT_EQ(other.differs, found[0].differs);
    EXPECT_EQ(other.strongly, found[0].strongly);
    EXPECT_EQ(other.shadow, found[0].shadow);
  }
  EXPECT_GT(found[0].shadow.count(), 500u);
}

TEST(Difference, PixelsOutsideTheRequestDoNotDiffer) {
  const cv::Mat image(3, 150, CV_8UC3, cv::Scalar::all(200));
  hull::ObjectPixels within(150, 3);
  within.set_run(60, 131, 1);
  const Difference found = differences(image, uniform_background(150, 3, 100, 1), plain(6, 12),
                                       {kNoGain, 0.5, 2, &within});
  EXPECT_EQ(found.differs, within);
  EXPECT_EQ(found.strongly, within);
}

// Near black, the mean minus its limit is below 0, so no level is darker. Near white, no level is
// brighter, and a saturated level is never darker.
TEST(Difference, BoundsStayInTheRangeOfALevel) {
  for (const int width : {3, 20}) {
    for (const auto& [mean, sigma] :
         {std::pair{0.4f, 1.0f}, {5.0f, 1.0f}, {127.6f, 2.5f}, {250.0f, 3.0f}, {254.7f, 0.0f}}) {
      const Background background = uniform_background(width, 1, mean, sigma);
      for (int level = 0; level < 256; ++level) {
        const Difference found = differences(cv::Mat(1, width, CV_8UC3, cv::Scalar::all(level)),
                                             background, plain(6, 12));
        const double distance = double(level) - std::floor(double(mean) + 0.5),
                     limit = std::max(12.0, 6 * double(sigma));
        ASSERT_EQ(found.differs.count(), std::abs(distance) > limit ? std::size_t(width) : 0u)
            << level << " of " << mean;
        ASSERT_EQ(found.shadow.count(),
                  distance < -limit && double(level) >= 0.5 * std::floor(double(mean) + 0.5)
                      ? std::size_t(width)
                      : 0u)
            << level << " of " << mean;
      }
    }
  }
}

// If the image is brighter than the background, a saturated level is an unknown higher one.
TEST(Difference, ASaturatedLevelIsNeverTooDark) {
  const Background background = uniform_background(70, 1, 240, 1);
  const InverseGain brighter = inverse_of({1.2, 1.2, 1.2});  // 255 becomes 212
  const DifferenceRequest request{brighter, 1, 2, nullptr};
  const auto count = [&](int level) {
    return differences(cv::Mat(1, 70, CV_8UC3, cv::Scalar::all(level)), background, plain(6, 12),
                       request)
        .differs.count();
  };
  EXPECT_EQ(count(255), 0u);
  EXPECT_EQ(count(254), 70u);
}

TEST(Difference, WithoutNoiseOnlyTheMeanIsTheEmptyScene) {
  for (const int width : {3, 16, 20})
    for (const int mean : {0, 1, 127, 254, 255}) {
      const Background background = uniform_background(width, 1, float(mean), 0);
      for (int level = 0; level < 256; ++level) {
        const Difference found = differences(cv::Mat(1, width, CV_8UC3, cv::Scalar::all(level)),
                                             background, plain(6, 0));
        const bool is_saturated_below = level == 255 && level < mean;
        ASSERT_EQ(found.differs.count(), level == mean || is_saturated_below ? 0u : unsigned(width))
            << level << ' ' << mean;
      }
    }
}

// Tolerance by tolerance: floor, noise, ceiling, and the gradient of the background.
TEST(Difference, ToleranceIsBoundedBelowAndAbove) {
  constexpr int kLevels = 100;
  for (const auto& [sigma, sigmas, floor_levels, ceiling_levels, expected] :
       {std::tuple{1.0f, 6.0, 12.0, 16.0, 12},
        {2.5f, 6.0, 12.0, 16.0, 15},
        {9.0f, 6.0, 12.0, 16.0, 16},
        {9.0f, 6.0, 12.0, 255.0, 54},
        {9.0f, 6.0, 30.0, 16.0, 30},
        {0.0f, 6.0, 0.0, 16.0, 0}}) {
    cv::Mat brighter(1, kLevels, CV_8UC3, cv::Scalar::all(120)), darker = brighter.clone();
    for (int u = 0; u < kLevels; ++u) {
      brighter.at<cv::Vec3b>(0, u)[1] = std::uint8_t(120 + u);
      darker.at<cv::Vec3b>(0, u)[2] = std::uint8_t(120 - u);
    }
    for (const cv::Mat& image : {brighter, darker}) {
      const Difference found = differences(image, uniform_background(kLevels, 1, 120, sigma),
                                           {sigmas, floor_levels, ceiling_levels, 0, 2});
      for (int u = 0; u < kLevels; ++u) {
        ASSERT_EQ(found.differs.contains(u, 0), u > expected) << u << " levels, sigma " << sigma;
        ASSERT_EQ(found.strongly.contains(u, 0), u > 2 * expected) << u;
      }
    }
  }
}

TEST(Difference, JitterWidensTheToleranceAtEdgesOnly) {
  cv::Mat room(5, 40, CV_8UC3, cv::Scalar::all(50));
  room(cv::Rect(20, 0, 20, 5)).setTo(cv::Scalar::all(150));
  const cv::Mat image = room + cv::Scalar::all(25);
  const auto found = [&](double jitter_px) {
    return differences(image, background_of(room, 0), {0, 10, 16, jitter_px, 2}).differs;
  };
  EXPECT_EQ(found(0).count(), 200u);
  // The gradient is 50 levels per pixel in the two columns at the edge: 10 + 0.4 * 50 = 30.
  EXPECT_EQ(found(0.4).count(), 190u);
  EXPECT_FALSE(found(0.4).contains(19, 2));
  EXPECT_FALSE(found(0.4).contains(20, 2));
  EXPECT_TRUE(found(0.4).contains(18, 2));
  EXPECT_TRUE(found(0.4).contains(21, 2));
  EXPECT_EQ(found(0.28).count(), 200u) << "10 + 14 levels";
}

// Pixels of a moving background, also in the second word and with different numbers of boxes.
TEST(Difference, AMovingPixelHasTheLevelsOfItsBoxes) {
  Background background = uniform_background(100, 2, 100, 1);
  const ColourBox dark{{10, 20, 30}, {20, 30, 40}}, bright{{200, 210, 220}, {205, 215, 225}};
  background.moving = {{3, {dark}}, {70, {dark, bright}}, {171, {bright}}};
  const auto differing = [&](const cv::Vec3b& level) {
    const hull::ObjectPixels found =
        differences(cv::Mat(2, 100, CV_8UC3, cv::Scalar(level)), background, plain(6, 12)).differs;
    std::vector<int> missing;
    for (int v = 0; v < 2; ++v)
      for (int u = 0; u < 100; ++u)
        if (!found.contains(u, v)) missing.push_back(100 * v + u);
    return missing;
  };
  using Pixels = std::vector<int>;
  EXPECT_EQ(differing({15, 25, 35}), (Pixels{3, 70}));
  EXPECT_EQ(differing({10, 30, 40}), (Pixels{3, 70})) << "bounds belong to the box";
  EXPECT_EQ(differing({9, 25, 35}), Pixels{});
  EXPECT_EQ(differing({15, 31, 35}), Pixels{});
  EXPECT_EQ(differing({15, 25, 29}), Pixels{});
  EXPECT_EQ(differing({205, 215, 225}), (Pixels{70, 171}));
  EXPECT_EQ(differing({15, 215, 225}), Pixels{});
  EXPECT_EQ(differing({100, 100, 100}).size(), 200u) << "the mean stays background";
}

// Compares with the definition (Horprasert, Harwood, Davis 1999) in double: shadow keeps the colour
// to within 8 levels or the angle of the request, whichever is more.
TEST(Shadow, MatchesItsDefinitionAtTheLimits) {
  constexpr double kRounding = 1e-3;  // of the float computation, in levels and in brightness
  constexpr int kWidth = 800, kHeight = 100;
  std::mt19937 random(7);
  int shadows = 0, others = 0, near_limit = 0;
  for (const auto& [min_brightness, tint_degrees] :
       {std::pair{0.2, 1.0}, {0.4, 2.0}, {0.55, 3.0}, {0.8, 8.0}}) {
    cv::Mat room = random_image(kWidth, kHeight, random()), image = room.clone();
    for (int i = 0; i < kWidth * kHeight; ++i) {
      // Near the limits: a fraction of the room's level, and up to 25 levels of another colour.
      const double fraction = 0.1 + double(random() % 1000) / 1000;
      for (int k = 3 * i; k < 3 * i + 3; ++k)
        image.data[k] =
            cv::saturate_cast<std::uint8_t>(fraction * room.data[k] + int(random() % 51) - 25);
    }
    // Every pixel that is not above its bound differs: no tolerance.
    const Difference found = differences(image, background_of(room, 0), plain(0, 0),
                                         {kNoGain, min_brightness, tint_degrees, nullptr});
    const double tint = std::tan(tint_degrees * std::numbers::pi / 180);
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u) {
        const cv::Vec3b &x = image.at<cv::Vec3b>(v, u), &r = room.at<cv::Vec3b>(v, u);
        const Eigen::Vector3d background(r[0], r[1], r[2]), pixel(x[0], x[1], x[2]);
        if (background.norm() == 0 || (pixel.array() > background.array()).any()) {
          ASSERT_FALSE(background.norm() > 0 && found.shadow.contains(u, v));
          continue;
        }
        const double s = pixel.dot(background) / background.squaredNorm(),
                     distortion_levels = (pixel - s * background).norm(),
                     limit_levels = std::max(8.0, tint * s * background.norm());
        if (std::abs(s - min_brightness) < kRounding || pixel == background ||
            std::abs(distortion_levels - limit_levels) < kRounding * limit_levels)
          continue;
        const bool expected = s > min_brightness && distortion_levels < limit_levels;
        ASSERT_EQ(found.shadow.contains(u, v), expected)
            << pixel.transpose() << " on " << background.transpose() << " from " << min_brightness;
        ++(expected ? shadows : others);
        near_limit += std::abs(distortion_levels - limit_levels) < 0.1 * limit_levels;
      }
  }
  EXPECT_GT(shadows, 10'000);
  EXPECT_GT(others, 10'000);
  EXPECT_GT(near_limit, 5'000);
}

TEST(Shadow, HasTheColourAndTheBrightnessOfTheRoom) {
  const auto is_shadow = [](const cv::Vec3b& pixel, const cv::Vec3b& room, double min_brightness) {
    return differences(cv::Mat(1, 1, CV_8UC3, cv::Scalar(pixel)),
                       background_of(cv::Mat(1, 1, CV_8UC3, cv::Scalar(room)), 0), plain(0, 0),
                       {kNoGain, min_brightness, 2, nullptr})
               .shadow.count() == 1;
  };
  const cv::Vec3b table(160, 170, 150), half(96, 102, 90), quarter(40, 43, 38), skin(70, 86, 112),
      black(0, 0, 0), grey(100, 100, 100), half_grey(50, 50, 50);
  EXPECT_TRUE(is_shadow(half, table, 0.5));
  EXPECT_FALSE(is_shadow(quarter, table, 0.5));
  EXPECT_TRUE(is_shadow(quarter, table, 0.2));
  EXPECT_FALSE(is_shadow(skin, table, 0.3));
  EXPECT_FALSE(is_shadow(black, table, 0.5));
  EXPECT_TRUE(is_shadow(half_grey, grey, 0.5)) << "exactly at the minimum brightness";
  EXPECT_FALSE(is_shadow({49, 50, 50}, grey, 0.5));
  EXPECT_FALSE(is_shadow(half_grey, grey, 1)) << "without suppression of shadow";
}

}  // namespace
}  // namespace fivepipe::capture
