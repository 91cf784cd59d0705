#include <algorithm>
#include <random>

#include "tests/support/capture/capture_rig.h"

namespace fivepipe::capture {
namespace {

hull::ObjectPixels random_pixels(int width_px, int height_px, double fraction, unsigned seed) {
  std::mt19937 random(seed);
  hull::ObjectPixels pixels(width_px, height_px);
  for (int v = 0; v < height_px; ++v)
    for (int u = 0; u < width_px; ++u) pixels.set(u, v, double(random()) < fraction * 4294967296.0);
  return pixels;
}

cv::Mat random_image(int width_px, int height_px, unsigned seed) {
  std::mt19937 random(seed);
  cv::Mat image(height_px, width_px, CV_8UC3);
  for (int i = 0; i < 3 * width_px * height_px; ++i) image.data[i] = std::uint8_t(random());
  return image;
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

TEST(Difference, MatchesPixelByPixelReferenceAtAnyWidth) {
  for (const int width : {1, 5, 15, 16, 17, 33, 64, 71, 645}) {
    const int height = 4;
    ReferenceImage reference{width, height, {}, {}};
    const cv::Mat mean = random_image(width, height, 1), image = random_image(width, height, 2);
    reference.mean_levels.assign(mean.data, mean.data + 3 * width * height);
    reference.sigma_levels.assign(std::size_t(3 * width * height), 9.0f);
    const Difference found = difference(image, difference_tables(reference, 6, 12));
    for (int v = 0; v < height; ++v)
      for (int u = 0; u < width; ++u) {
        bool above = false, below = false;
        for (int c = 0; c < 3; ++c) {
          const int d = image.at<cv::Vec3b>(v, u)[c] - mean.at<cv::Vec3b>(v, u)[c];
          above = above || d > 54;  // 6 sigmas of 9 levels
          below = below || d < -54;
        }
        ASSERT_EQ(found.differs.contains(u, v), above || below) << width << ": " << u << " " << v;
        ASSERT_EQ(found.darker.contains(u, v), below && !above) << width << ": " << u << " " << v;
      }
  }
}

// Near black, the mean minus its limit is below 0, so no level is darker. Near white, no level is
// brighter.
TEST(Difference, BoundsStayInTheRangeOfALevel) {
  for (const int width : {3, 20}) {
    for (const auto& [mean, sigma] :
         {std::pair{0.4f, 1.0f}, {5.0f, 1.0f}, {127.6f, 2.5f}, {250.0f, 3.0f}, {254.7f, 0.0f}}) {
      ReferenceImage reference{width, 1, {}, {}};
      reference.mean_levels.assign(std::size_t(3 * width), mean);
      reference.sigma_levels.assign(std::size_t(3 * width), sigma);
      for (int level = 0; level < 256; ++level) {
        const cv::Mat image(1, width, CV_8UC3, cv::Scalar::all(level));
        const Difference found = difference(image, difference_tables(reference, 6, 12));
        const double distance = double(level) - double(mean),
                     limit = std::max(12.0, 6 * double(sigma));
        ASSERT_EQ(found.differs.count(), std::abs(distance) > limit ? std::size_t(width) : 0u)
            << level << " of " << mean;
        ASSERT_EQ(found.darker.count(), distance < -limit ? std::size_t(width) : 0u)
            << level << " of " << mean;
      }
    }
  }
}

TEST(ReferenceImage, IsRobustToTransientForeground) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 3);
  std::vector<cv::Mat> frames;
  for (int f = 0; f < 32; ++f) {
    cv::Mat frame(40, 50, CV_8UC3, cv::Scalar(100, 120, 140));
    for (int i = 0; i < 3 * 40 * 50; ++i)
      frame.data[i] = cv::saturate_cast<std::uint8_t>(frame.data[i] + noise(random));
    if (f % 8 == 0)
      frame(cv::Rect(10, 10, 20, 20)).setTo(cv::Scalar(10, 240, 10));  // 4 of 32 frames
    frames.push_back(frame);
  }
  const ReferenceImage reference = learn_reference(frames);
  double sigma_sum = 0;
  for (std::size_t i = 0; i < reference.mean_levels.size(); ++i) {
    // Six standard errors of the mean of 28 samples.
    ASSERT_NEAR(reference.mean_levels[i], 100 + 20 * double(i % 3), 6 * 3 / std::sqrt(28.0)) << i;
    sigma_sum += reference.sigma_levels[i];
  }
  // Rounding adds 1/12 to the variance. Trimming by the median deviation of few samples sometimes
  // removes a few valid ones.
  EXPECT_NEAR(sigma_sum / double(reference.sigma_levels.size()), std::sqrt(9 + 1 / 12.0), 0.15);
}

TEST(ReferenceImage, MatchesTrimmedMeanForAnyFrameCount) {
  for (int n = 1; n <= 33; ++n) {
    std::vector<cv::Mat> frames;
    for (int f = 0; f < n; ++f) frames.push_back(random_image(5, 3, unsigned(100 * n + f)));
    const ReferenceImage reference = learn_reference(frames);
    for (int i = 0; i < 5 * 3 * 3; ++i) {
      std::vector<int> levels, deviations;
      for (const cv::Mat& frame : frames) levels.push_back(frame.data[i]);
      std::sort(levels.begin(), levels.end());
      const int median = levels[std::size_t(n / 2)];
      for (const int level : levels) deviations.push_back(std::abs(level - median));
      std::sort(deviations.begin(), deviations.end());
      const double max_deviation =
          std::max(kTrimFloor_levels, kTrim_sigmas * 1.4826 * deviations[std::size_t(n / 2)]);
      double sum = 0, kept = 0;
      for (const int level : levels)
        if (std::abs(level - median) <= max_deviation) {
          sum += level;
          ++kept;
        }
      ASSERT_NEAR(reference.mean_levels[std::size_t(i)], sum / kept, 1e-4)
          << n << " frames, element " << i;  // float
    }
  }
}

// Mean and noise of the kept samples, by their definition, for images of several sizes.
TEST(ReferenceImage, NoiseIsTheDeviationOfTheSamplesNearTheMedian) {
  for (const int n : {1, 7, 8, 9, 24}) {
    std::vector<cv::Mat> frames;
    std::mt19937 random{unsigned(n)};
    for (int f = 0; f < n; ++f) {
      cv::Mat frame(3, 17, CV_8UC3);
      for (int i = 0; i < 3 * 17 * 3; ++i) {
        const int spread = i % 7;  // 0: quiet, and some samples far off at the limits of the trim
        frame.data[i] = std::uint8_t(100 + int(random() % unsigned(2 * spread + 1)) - spread +
                                     (random() % 9 == 0 ? int(random() % 60) - 30 : 0));
      }
      frames.push_back(frame);
    }
    const ReferenceImage reference = learn_reference(frames);
    EXPECT_EQ(reference.width_px, 17);
    EXPECT_EQ(reference.height_px, 3);
    int trimmed = 0, kept_at_limit = 0;
    for (std::size_t i = 0; i < 3 * 17 * 3; ++i) {
      std::vector<double> levels, deviations, kept;
      for (const cv::Mat& frame : frames) levels.push_back(frame.data[i]);
      std::sort(levels.begin(), levels.end());
      const double median = levels[std::size_t(n / 2)];
      for (const double level : levels) deviations.push_back(std::abs(level - median));
      std::sort(deviations.begin(), deviations.end());
      const double limit = std::max(4.0, 4 * 1.4826 * deviations[std::size_t(n / 2)]);
      double sum = 0, squares = 0;
      for (const double level : levels)
        if (std::abs(level - median) <= limit) kept.push_back(level);
      for (const double level : kept) sum += level;
      const double mean = sum / double(kept.size());
      for (const double level : kept) squares += (level - mean) * (level - mean);
      trimmed += kept.size() < levels.size();
      kept_at_limit += std::count(deviations.begin(), deviations.end(), 4.0) > 0 && limit == 4;
      ASSERT_NEAR(reference.mean_levels[i], mean, 1e-4) << n << ' ' << i;
      ASSERT_NEAR(reference.sigma_levels[i],
                  n < 8             ? 2.0
                  : kept.size() > 1 ? std::sqrt(squares / double(kept.size() - 1))
                                    : 0.0,
                  1e-3)
          << n << ' ' << i;
    }
    if (n > 1) {
      EXPECT_GT(trimmed, 5);
      EXPECT_GT(kept_at_limit, 0);
    }
  }
}

TEST(ReferenceImage, OnePictureHasTheAssumedNoise) {
  const cv::Mat plate = random_image(31, 5, 4);
  const ReferenceImage reference = learn_reference({&plate, 1});
  for (std::size_t i = 0; i < reference.mean_levels.size(); ++i) {
    ASSERT_EQ(reference.mean_levels[i], plate.data[i]);
    ASSERT_EQ(reference.sigma_levels[i], float(kPlateSigma_levels));
  }
}

// The configuration's threshold, level by level: a row per noise, a column per difference.
TEST(Segmentation, ThresholdIsTheLargerOfFloorAndSigmas) {
  constexpr int kDifferences = 100, kNoises = 12;
  ReferenceImage reference{kDifferences, kNoises, {}, {}};
  cv::Mat brighter(kNoises, kDifferences, CV_8UC3), darker = brighter.clone();
  for (int v = 0; v < kNoises; ++v)
    for (int u = 0; u < kDifferences; ++u) {
      for (int c = 0; c < 3; ++c) {
        reference.mean_levels.push_back(120);
        reference.sigma_levels.push_back(float(v));
      }
      // One channel differs, the second of the three.
      brighter.at<cv::Vec3b>(v, u) = cv::Vec3b(120, std::uint8_t(120 + u), 120);
      darker.at<cv::Vec3b>(v, u) = cv::Vec3b(120, std::uint8_t(120 - u), 120);
    }
  const config::RigCamera camera = test::table_camera("any", {0, -1, 1}, kDifferences, kNoises);
  for (const auto& [sigmas, floor_levels] :
       {std::pair{6.0, 12.0}, {6.0, 30.0}, {3.0, 12.0}, {8.0, 0.0}}) {
    config::SegmentationConfig config;
    config.threshold_sigmas = sigmas;
    config.threshold_floor_levels = floor_levels;
    config.shadow_min_brightness = 1;
    config.opening_px = 0;
    const Segmenter segmenter(camera, reference, config);
    for (const cv::Mat& image : {brighter, darker}) {
      const hull::ObjectPixels found = segmenter.segment(image).value();
      for (int v = 0; v < kNoises; ++v)
        for (int u = 0; u < kDifferences; ++u)
          ASSERT_EQ(found.contains(u, v), u > floor_levels && u > sigmas * v)
              << u << " levels, noise " << v << ", " << sigmas << " sigmas, floor " << floor_levels;
    }
  }
  const config::SegmentationConfig defaults;
  EXPECT_EQ(defaults.threshold_sigmas, 6);
  EXPECT_EQ(defaults.threshold_floor_levels, 12);
}

// Compares with the definition (Horprasert, Harwood, Davis 1999) in double: shadow keeps the colour
// to within 8 levels or 6 % of the brightness, whichever is more.
TEST(Shadow, MatchesItsDefinitionAtTheLimits) {
  constexpr double kRounding = 1e-3;  // of the float computation, in levels and in brightness
  std::mt19937 random(7);
  int shadows = 0, others = 0, near_limit = 0;
  for (int i = 0; i < 400'000; ++i) {
    const double min_brightness = 0.2 + 0.6 * double(random() % 1000) / 1000;
    std::uint8_t r[3], x[3];
    // Near the limits: a fraction of the reference, and up to 25 levels of another colour.
    const double fraction = 0.1 + double(random() % 1000) / 1000;
    for (int c = 0; c < 3; ++c) {
      r[c] = std::uint8_t(random() % 256);
      x[c] = cv::saturate_cast<std::uint8_t>(fraction * r[c] + int(random() % 51) - 25);
    }
    const Eigen::Vector3d reference(r[0], r[1], r[2]), pixel(x[0], x[1], x[2]);
    if (reference.norm() == 0) continue;
    const double s = pixel.dot(reference) / reference.squaredNorm(),
                 distortion_levels = (pixel - s * reference).norm(),
                 limit_levels = std::max(8.0, 0.06 * s * reference.norm());
    if (std::abs(s - min_brightness) < kRounding ||
        std::abs(distortion_levels - limit_levels) < kRounding * limit_levels)
      continue;
    const bool expected = s > min_brightness && distortion_levels < limit_levels;
    ASSERT_EQ(is_shadow(x, r, min_brightness), expected)
        << pixel.transpose() << " on " << reference.transpose() << " from " << min_brightness;
    ++(expected ? shadows : others);
    near_limit += std::abs(distortion_levels - limit_levels) < 0.1 * limit_levels;
  }
  EXPECT_GT(shadows, 20'000);
  EXPECT_GT(others, 20'000);
  EXPECT_GT(near_limit, 20'000);
}

// Shadow of the room's colour is no object down to the configured brightness, and never if it is
// brighter than the room.
TEST(Segmentation, ShadowReachesDownToTheConfiguredBrightness) {
  constexpr int kLevels = 200;  // of the room
  ReferenceImage reference{kLevels, 1, {}, {}};
  cv::Mat image(1, kLevels, CV_8UC3);
  for (int u = 0; u < kLevels; ++u) {
    for (int c = 0; c < 3; ++c) {
      reference.mean_levels.push_back(kLevels);
      reference.sigma_levels.push_back(1);
    }
    image.at<cv::Vec3b>(0, u) = cv::Vec3b::all(std::uint8_t(u));
  }
  const config::RigCamera camera = test::table_camera("any", {0, -1, 1}, kLevels, 1);
  for (const double min_brightness : {0.3, 0.5, 0.85}) {
    config::SegmentationConfig config;
    config.shadow_min_brightness = min_brightness;
    config.opening_px = 0;
    const hull::ObjectPixels found = Segmenter(camera, reference, config).segment(image).value();
    for (int u = 0; u < kLevels; ++u)
      if (std::abs(u - min_brightness * kLevels) > 0.01) {  // rounding to float
        ASSERT_EQ(found.contains(u, 0), u < min_brightness * kLevels) << u;
      }
  }
}

TEST(Shadow, RequiresSameColourAndMinimumBrightness) {
  const std::uint8_t table[] = {160, 170, 150}, half[] = {96, 102, 90}, quarter[] = {40, 43, 38},
                     skin[] = {70, 86, 112}, black[] = {0, 0, 0};
  EXPECT_TRUE(is_shadow(half, table, 0.5));
  EXPECT_FALSE(is_shadow(quarter, table, 0.5));
  EXPECT_TRUE(is_shadow(quarter, table, 0.2));
  EXPECT_FALSE(is_shadow(skin, table, 0.3));
  EXPECT_FALSE(is_shadow(black, table, 0.5));
  // On a black reference, every pixel has full brightness: the distortion is its own length.
  const std::uint8_t faint[] = {4, 4, 5}, at_limit[] = {0, 8, 0}, beyond[] = {1, 8, 0},
                     dark[] = {0, 1, 0};
  EXPECT_TRUE(is_shadow(black, black, 0.5));
  EXPECT_TRUE(is_shadow(faint, black, 0.5));
  EXPECT_TRUE(is_shadow(at_limit, black, 0.5));
  EXPECT_FALSE(is_shadow(beyond, black, 0.5));
  // x.r = 8, r.r = 1: the brightness is 8, and all of the pixel is along the reference.
  const std::uint8_t green[] = {0, 200, 0}, other[] = {8, 200, 0};
  EXPECT_TRUE(is_shadow(green, dark, 0.5));
  EXPECT_TRUE(is_shadow(other, dark, 0.5));
  // Exactly at the minimum brightness: x.r / r.r = 1/2.
  const std::uint8_t grey[] = {100, 100, 100}, half_grey[] = {50, 50, 50};
  EXPECT_TRUE(is_shadow(half_grey, grey, 0.5));
}

// A contrast of 24 levels in one channel is always detected: 6 sigmas of 2 levels, and 6 sigmas for
// the noise of the image. A pixel deeper than 2 px is entirely inside the object, and opening by
// 1 px keeps it. The segmentation may miss single pixels whose colour equals the room's. Here
// it misses 0 to 8 of 10,000 pixels; the bound is 2 of 1000. Outside the object, noise never
// exceeds 6 sigmas, and opening removes the specks that a shadow leaves.
void expect_like_truth(const hull::ObjectPixels& found, const hull::ObjectPixels& touched) {
  const hull::ObjectPixels inner = eroded(touched, 2);
  ASSERT_GT(inner.count(), 3000u);
  EXPECT_LE(test::count_not_in(inner, found), inner.count() / 500);
  EXPECT_EQ(test::count_not_in(found, dilated(touched, 2)), 0u);
}

TEST(Segmentation, FindsTheObjectWithoutItsShadowInEveryCamera) {
  const config::SyntheticWorld world;
  for (const config::RigCamera& camera : test::table_cameras()) {
    test::TestCamera eye(camera, world, {});
    for (const int frame : {0, 37, 80}) {
      SCOPED_TRACE(camera.name + " " + std::to_string(frame));
      expect_like_truth(
          eye.segment(frame),
          hull::true_object_pixels(test::synthetic_object(world, frame / 30.0),
                                   config::published_camera(camera), hull::PixelRule::touched));
    }
  }
}

TEST(Segmentation, ShadowIsObjectOnlyIfSuppressionIsOff) {
  const config::SyntheticWorld world;
  config::SegmentationConfig keeps_shadow;
  keeps_shadow.shadow_min_brightness = 1;
  test::TestCamera without(test::table_cameras()[0], world, {}),
      with(test::table_cameras()[0], world, keeps_shadow);
  EXPECT_GT(with.segment(20).count(), without.segment(20).count() + 3000);
  config::SyntheticWorld no_shadow;
  no_shadow.cast_shadow = false;
  test::TestCamera none(test::table_cameras()[0], no_shadow, keeps_shadow);
  expect_like_truth(
      none.segment(20),
      hull::true_object_pixels(test::synthetic_object(no_shadow, 20 / 30.0),
                               config::published_camera(none.camera), hull::PixelRule::touched));
}

TEST(Segmentation, FindsTheObjectWithAReferenceOfOnePicture) {
  const config::SyntheticWorld world;
  test::TestCamera eye(test::table_cameras()[0], world, {}, 1);
  // The plate's noise of 2 levels adds to the image's: 12 levels are then 4.2 sigmas, and opening
  // removes specks of one pixel.
  expect_like_truth(
      eye.segment(20),
      hull::true_object_pixels(test::synthetic_object(world, 20 / 30.0),
                               config::published_camera(eye.camera), hull::PixelRule::touched));
}

TEST(Segmentation, OpeningRemovesSaltAndPepper) {
  const config::SyntheticWorld world;
  test::TestCamera eye(test::table_cameras()[0], world, {});
  cv::Mat image;
  eye.source.read(20, image);
  std::mt19937 random(5);
  for (int i = 0; i < image.rows * image.cols / 100; ++i)
    image.at<cv::Vec3b>(int(random() % unsigned(image.rows)),
                        int(random() % unsigned(image.cols))) =
        i % 2 ? cv::Vec3b(255, 255, 255) : cv::Vec3b(0, 0, 0);
  // All nine pixels of a 3x3 square are noise with probability 1e-18. Next to the object, specks
  // can join it, at most one square away.
  const hull::ObjectPixels touched =
      hull::true_object_pixels(test::synthetic_object(world, 20 / 30.0),
                               config::published_camera(eye.camera), hull::PixelRule::touched);
  EXPECT_EQ(test::count_not_in(eye.segmenter.segment(image).value(), dilated(touched, 3)), 0u);
  // Black or white noise on the object stays object, because the object has neither colour.
  EXPECT_LE(test::count_not_in(eroded(touched, 2), eye.segmenter.segment(image).value()),
            touched.count() / 500);
}

TEST(Segmentation, ClosingFillsHoles) {
  config::SegmentationConfig config;
  config.shadow_min_brightness = 1;
  const cv::Mat plate(40, 70, CV_8UC3, cv::Scalar(100, 100, 100));
  cv::Mat image = plate.clone();
  image(cv::Rect(10, 10, 40, 20)).setTo(cv::Scalar(200, 100, 100));
  image(cv::Rect(30, 20, 4, 4)).setTo(cv::Scalar(100, 100, 100));
  const config::RigCamera camera = test::table_camera("any", {0, -1, 1}, 70, 40);
  EXPECT_EQ(Segmenter(camera, learn_reference({&plate, 1}), config).segment(image)->count(),
            800u - 16u);
  config.closing_px = 2;
  EXPECT_EQ(Segmenter(camera, learn_reference({&plate, 1}), config).segment(image)->count(), 800u);
}

TEST(Segmentation, DiagnosesMapsWithAllAndWithNoPixels) {
  const cv::Mat plate(33, 71, CV_8UC3, cv::Scalar(100, 100, 100)),
      other(33, 71, CV_8UC3, cv::Scalar(10, 220, 100));
  const Segmenter segmenter(test::table_camera("any", {0, -1, 1}, 71, 33),
                            learn_reference({&plate, 1}), {});
  EXPECT_EQ(segmenter.segment(other)->count(), 71u * 33u);
  EXPECT_EQ(segmentation_diagnostics(*segmenter.segment(other)).size(), 1u);
  EXPECT_EQ(segmenter.segment(plate)->count(), 0u);
  EXPECT_EQ(segmentation_diagnostics(*segmenter.segment(plate)).size(), 1u);
}

TEST(Segmentation, DiagnosticsNameTheFractionOfTheImage) {
  const auto diagnostics = [](int set) {
    hull::ObjectPixels pixels(50, 20);
    for (int i = 0; i < set; ++i) pixels.set(i % 50, i / 50);
    const std::vector<std::string> found = segmentation_diagnostics(pixels);
    return found.empty() ? "" : found.at(0);
  };
  EXPECT_EQ(diagnostics(0), "no object pixels: the hull is empty");
  hull::ObjectPixels some(50, 20);
  some.set(3, 4);
  EXPECT_EQ(
      segmentation_diagnostics(some, 1),
      std::vector<std::string>{"object pixels are outside the published image, so the hull is "
                               "cut: in the rig, enlarge or remove `published` of the camera"});
  EXPECT_EQ(diagnostics(1), "");
  EXPECT_EQ(diagnostics(600), "");
  const std::string rest =
      " % of the image are object pixels: check exposure, light and camera position, then restart "
      "the node";
  EXPECT_EQ(diagnostics(601), "60" + rest);
  EXPECT_EQ(diagnostics(857), "85" + rest);
  EXPECT_EQ(diagnostics(1000), "100" + rest);
}

// A pixel is compared with the rounded mean of its own reference, also beyond the first word.
TEST(Segmentation, ShadowIsComparedWithTheReferenceOfItsPixel) {
  constexpr int kWidth_px = 150, kHeight_px = 3;
  ReferenceImage reference{kWidth_px, kHeight_px, {}, {}};
  cv::Mat image(kHeight_px, kWidth_px, CV_8UC3);
  std::mt19937 random(9);
  std::vector<bool> is_object;
  for (int v = 0; v < kHeight_px; ++v)
    for (int u = 0; u < kWidth_px; ++u) {
      const float mean[3] = {float(random() % 2000) / 10 + 20, float(random() % 2000) / 10 + 20,
                             float(random() % 2000) / 10 + 20};
      std::uint8_t rounded[3], pixel[3];
      bool differs = false, brighter = false;
      const double fraction = 0.3 + double(random() % 1000) / 1000;
      for (int c = 0; c < 3; ++c) {
        reference.mean_levels.push_back(mean[c]);
        reference.sigma_levels.push_back(0);
        rounded[c] = std::uint8_t(std::lround(mean[c]));
        pixel[c] = cv::saturate_cast<std::uint8_t>(fraction * double(mean[c]) + int(random() % 9));
        image.at<cv::Vec3b>(v, u)[c] = pixel[c];
        differs = differs || std::abs(float(pixel[c]) - mean[c]) > 12;
        brighter = brighter || float(pixel[c]) - mean[c] > 12;
      }
      is_object.push_back(differs && (brighter || !is_shadow(pixel, rounded, 0.5)));
    }
  config::SegmentationConfig config;
  config.opening_px = 0;
  const config::RigCamera camera = test::table_camera("any", {0, -1, 1}, kWidth_px, kHeight_px);
  const hull::ObjectPixels found = Segmenter(camera, reference, config).segment(image).value();
  for (int v = 0; v < kHeight_px; ++v)
    for (int u = 0; u < kWidth_px; ++u)
      ASSERT_EQ(found.contains(u, v), is_object[std::size_t(v * kWidth_px + u)]) << u << ' ' << v;
  EXPECT_GT(found.count(), 50u);
  EXPECT_LT(found.count(), 400u);
}

TEST(Segmentation, RejectsImagesOfOtherSizeOrType) {
  const cv::Mat plate(33, 71, CV_8UC3, cv::Scalar(100, 100, 100));
  const Segmenter segmenter(test::table_camera("any", {0, -1, 1}, 71, 33),
                            learn_reference({&plate, 1}), {});
  EXPECT_FALSE(segmenter.segment(cv::Mat(71, 33, CV_8UC3)));
  EXPECT_FALSE(segmenter.segment(cv::Mat(33, 71, CV_8UC1)));
  EXPECT_FALSE(segmenter.segment(cv::Mat(33, 72, CV_8UC3)));
  EXPECT_FALSE(segmenter.segment(cv::Mat(34, 71, CV_8UC3)));
  EXPECT_FALSE(segmenter.segment(cv::Mat()));
}

TEST(Segmentation, KeepsAnObjectCutByTheImageBorder) {
  const cv::Mat plate(30, 65, CV_8UC3, cv::Scalar(100, 100, 100));
  cv::Mat image = plate.clone();
  image(cv::Rect(60, 0, 5, 12)).setTo(cv::Scalar(10, 220, 100));
  const Segmenter segmenter(test::table_camera("any", {0, -1, 1}, 65, 30),
                            learn_reference({&plate, 1}), {});
  EXPECT_EQ(segmenter.segment(image)->count(), 60u);
  EXPECT_EQ(segmenter.segment(image)->bounds(), (hull::PixelRect{60, 0, 65, 12}));
}

}  // namespace
}  // namespace fivepipe::capture
