// Segmentation of images of the synthetic room, and its steps.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "tests/support/capture/capture_rig.h"

namespace fivepipe::capture {
namespace {

// A contrast of 16 levels in one channel is certain: twice the tolerance, which is 8 levels, 4
// sigmas of the noise. A pixel deeper than 2 px is entirely inside the object. The segmentation may
// miss single pixels whose colour equals the room's: at most 2 of 1000. Outside the object, noise
// is nowhere certain in 30 connected pixels.
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
  // The plate's noise of 2 levels adds to the image's: 8 levels are then 2.8 sigmas, and 16 levels,
  // which are certain, 5.7.
  expect_like_truth(
      eye.segment(20),
      hull::true_object_pixels(test::synthetic_object(world, 20 / 30.0),
                               config::published_camera(eye.camera), hull::PixelRule::touched));
}

TEST(Segmentation, SaltAndPepperIsNoObject) {
  const config::SyntheticWorld world;
  test::TestCamera eye(test::table_cameras()[0], world, {});
  cv::Mat image;
  eye.source.read(20, image);
  std::mt19937 random(5);
  for (int i = 0; i < image.rows * image.cols / 100; ++i) {
    const int v = int(random() % unsigned(image.rows)), u = int(random() % unsigned(image.cols));
    image.at<cv::Vec3b>(v, u) = i % 2 ? cv::Vec3b(255, 255, 255) : cv::Vec3b(0, 0, 0);
  }
  // Thirty connected pixels are noise with a probability below 1e-30. Next to the object, specks
  // can join it, a few pixels away.
  const hull::ObjectPixels touched =
      hull::true_object_pixels(test::synthetic_object(world, 20 / 30.0),
                               config::published_camera(eye.camera), hull::PixelRule::touched);
  EXPECT_EQ(test::count_not_in(eye.segmenter.segment(image)->object, dilated(touched, 4)), 0u);
  // Black or white noise on the object stays object, because the object has neither colour.
  EXPECT_LE(test::count_not_in(eroded(touched, 2), eye.segmenter.segment(image)->object),
            touched.count() / 500);
}

// A room of one colour, and a picture of it that a test draws into.
struct Plain {
  explicit Plain(int width_px = 150, int height_px = 60)
      : image(height_px, width_px, CV_8UC3, kRoom) {}

  Segmenter segmenter(const config::SegmentationConfig& config = {},
                      std::optional<hull::ObjectPixels> within = {}) const {
    const cv::Mat room(image.rows, image.cols, CV_8UC3, kRoom);
    return Segmenter(learn_background({&room, 1}), config, std::move(within));
  }
  hull::ObjectPixels object(const config::SegmentationConfig& config = {}) const {
    return segmenter(config).segment(image)->object;
  }
  void fill(const cv::Rect& rect, const cv::Scalar& colour) { image(rect).setTo(colour); }
  void add(const cv::Rect& rect, int levels) { image(rect) += cv::Scalar::all(levels); }

  static inline const cv::Scalar kRoom{100, 100, 100}, kOther{200, 60, 100};
  cv::Mat image;
};

TEST(Segmentation, HolesUpToTheConfiguredAreaAreFilled) {
  Plain plain;
  plain.fill({10, 10, 40, 20}, Plain::kOther);
  plain.fill({30, 20, 5, 10 - 3}, Plain::kRoom);  // 35 px
  config::SegmentationConfig config;
  config.max_hole_px = 34;
  EXPECT_EQ(plain.object(config).count(), 800u - 35u);
  config.max_hole_px = 35;
  EXPECT_EQ(plain.object(config).count(), 800u);
}

TEST(Segmentation, ClosingFillsHolesOfItsWidth) {
  Plain plain;
  plain.fill({10, 10, 40, 20}, Plain::kOther);
  plain.fill({30, 20, 4, 4}, Plain::kRoom);
  config::SegmentationConfig config;
  config.max_hole_px = 0;
  EXPECT_EQ(plain.object(config).count(), 800u - 16u);
  config.closing_px = 2;
  EXPECT_EQ(plain.object(config).count(), 800u);
}

TEST(Segmentation, RegionsSmallerThanTheConfiguredAreaAreNoObjects) {
  Plain plain;
  plain.fill({10, 10, 6, 5}, Plain::kOther);
  config::SegmentationConfig config;
  config.min_object_px = 31;
  EXPECT_EQ(plain.object(config).count(), 0u);
  config.min_object_px = 30;
  EXPECT_EQ(plain.object(config).count(), 30u);
}

// The plate has a noise of 2 levels, so a pixel differs beyond 8 levels and strongly beyond 16.
TEST(Segmentation, ARegionWithoutACertainPixelIsNoObject) {
  Plain plain;
  plain.add({10, 10, 20, 20}, 12);
  EXPECT_EQ(plain.object().count(), 0u);
  plain.add({15, 15, 1, 1}, 12);
  // A corner has four pixels of the nine in its neighbourhood, no majority.
  EXPECT_EQ(plain.object().count(), 400u - 4u);
  config::SegmentationConfig config;
  config.hysteresis = 1.4;  // 11.2 levels
  plain.add({15, 15, 1, 1}, -12);
  EXPECT_EQ(plain.object(config).count(), 400u);
}

// Of the pixels that only just differ, those count that most of their neighbours agree with.
TEST(Segmentation, AMajorityDecidesUncertainPixels) {
  Plain plain;
  plain.fill({20, 20, 20, 20}, Plain::kOther);
  for (int u = 60; u < 120; u += 2) plain.add({u, 20, 1, 1}, 12);  // specks
  plain.add({40, 25, 1, 10}, 12);  // beside the object: three to six of nine
  config::SegmentationConfig config;
  config.min_object_px = 0;
  const hull::ObjectPixels found = plain.object(config);
  EXPECT_EQ(found.bounds(), (hull::PixelRect{20, 20, 41, 40}));
  EXPECT_EQ(found.count(), 400u + 10u);
}

TEST(Segmentation, OpeningRemovesThinParts) {
  Plain plain;
  plain.fill({10, 10, 20, 20}, Plain::kOther);
  plain.fill({30, 20, 40, 1}, Plain::kOther);
  config::SegmentationConfig config;
  EXPECT_EQ(plain.object(config).count(), 440u);
  config.opening_px = 1;
  EXPECT_EQ(plain.object(config).count(), 400u);
}

// A shadow of the room's colour is no object down to the configured brightness.
TEST(Segmentation, ShadowReachesDownToTheConfiguredBrightness) {
  for (const double min_brightness : {0.3, 0.5, 0.85}) {
    config::SegmentationConfig config;
    config.shadow_min_brightness = min_brightness;
    config.gain_compensation = false;
    for (int level = 10; level < 92; ++level) {
      if (std::abs(level - 100 * min_brightness) < 1 || level >= 84) continue;  // not certain
      Plain plain;
      plain.fill({10, 10, 30, 30}, cv::Scalar::all(level));
      // The strip around a shadow is no object either.
      EXPECT_EQ(plain.object(config).count() > 0, level < 100 * min_brightness)
          << level << ", minimum " << min_brightness;
    }
  }
  config::SegmentationConfig off;
  off.shadow_min_brightness = 1;
  Plain plain;
  plain.fill({10, 10, 30, 30}, cv::Scalar::all(80));
  EXPECT_EQ(plain.object(off).count(), 900u);
}

// A darker patch is shadow up to the configured angle between its colour and the room's.
TEST(Segmentation, ShadowKeepsTheColourToWithinTheConfiguredAngle) {
  constexpr double kLevel = 70, kRounding_degrees = 0.7;  // of the levels to integers
  const double length_levels = kLevel * std::sqrt(3.0);
  for (const double tint_degrees : {5.0, 8.0, 12.0}) {
    config::SegmentationConfig config;
    config.shadow_tint_degrees = tint_degrees;
    config.gain_compensation = false;
    for (int degrees = 1; degrees < 20; ++degrees) {
      if (std::abs(degrees - tint_degrees) < kRounding_degrees) continue;
      const double off_levels =
          length_levels * std::tan(degrees * std::numbers::pi / 180) / std::numbers::sqrt2;
      Plain plain;
      plain.fill({10, 10, 30, 30},
                 {std::round(kLevel + off_levels), std::round(kLevel - off_levels), kLevel});
      EXPECT_EQ(plain.object(config).count() > 0, degrees > tint_degrees)
          << degrees << ", maximum " << tint_degrees;
    }
  }
}

// Single pixels of another colour in a shadow are noise; three neighbours of it are an object.
TEST(Segmentation, NeighboursDecideWhatIsShadow) {
  Plain plain;
  plain.fill({10, 10, 100, 40}, cv::Scalar::all(70));
  plain.fill({20, 20, 1, 1}, Plain::kOther);
  plain.fill({40, 20, 2, 1}, Plain::kOther);
  plain.fill({60, 20, 20, 20}, Plain::kOther);
  plain.fill({70, 30, 1, 1}, cv::Scalar::all(70));  // looks like shadow, inside the object
  const hull::ObjectPixels found = plain.object();
  EXPECT_FALSE(found.contains(20, 20));
  EXPECT_FALSE(found.contains(40, 20));
  EXPECT_TRUE(found.contains(70, 30));
  EXPECT_EQ(found.bounds(), (hull::PixelRect{60, 20, 80, 40}));
  EXPECT_EQ(found.count(), 400u);
}

// The exposure changes; an object that is only 20 levels brighter than the room stays one.
TEST(Segmentation, ChangesOfTheWholeImageAreNoObject) {
  for (const double gain : {0.75, 0.9, 1.15, 1.4}) {
    Plain plain;
    plain.fill({20, 20, 30, 30}, cv::Scalar(140, 100, 60));
    plain.image.convertTo(plain.image, -1, gain);
    EXPECT_EQ(plain.object().count(), 900u) << gain;
    config::SegmentationConfig off;
    off.gain_compensation = false;
    off.shadow_min_brightness = 1;
    EXPECT_GT(plain.object(off).count(), 8000u) << gain;
  }
}

TEST(Segmentation, ConservativeKeepsEveryPixelThatDiffers) {
  Plain plain;
  plain.add({3, 3, 1, 1}, 9);                         // one uncertain pixel
  plain.fill({10, 10, 30, 30}, cv::Scalar::all(70));  // a shadow
  plain.fill({60, 20, 20, 1}, Plain::kOther);         // a thin part
  config::SegmentationConfig config;
  config.opening_px = 3;
  EXPECT_EQ(plain.object(config).count(), 0u);
  config.conservative = true;
  EXPECT_EQ(plain.object(config).count(), 1u + 900u + 20u);
}

// These steps widen what counts as background, or move it.
TEST(Segmentation, ConservativeLeavesOutWhatChangesTheBackground) {
  config::SegmentationConfig config;
  config.jitter_px = 5;
  config.adaptation_s = 0.001;
  EXPECT_EQ(tolerances(config).jitter_px, 5);
  EXPECT_TRUE(learning_settings(config).compensates_gain);
  EXPECT_EQ(learning_settings(config).moving_boxes, 4);
  Plain brighter;
  brighter.fill({0, 0, 150, 60}, cv::Scalar::all(110));
  EXPECT_EQ(brighter.object(config).count(), 0u) << "the whole image is brighter";
  config.conservative = true;
  EXPECT_EQ(tolerances(config).jitter_px, 0);
  EXPECT_FALSE(learning_settings(config).compensates_gain);
  EXPECT_EQ(learning_settings(config).moving_boxes, 0);
  EXPECT_EQ(brighter.object(config).count(), 150u * 60u);
}

// On the synthetic room, object pixels beyond the noise are lost by the normal steps only.
TEST(Segmentation, ConservativeContainsTheNormalMap) {
  config::SegmentationConfig config;
  config.conservative = true;
  const config::SyntheticWorld world;
  const config::RigCamera camera = test::table_cameras()[0];
  test::TestCamera normal(camera, world, {}), conservative(camera, world, config);
  for (const int frame : {0, 50}) {
    const hull::ObjectPixels all = conservative.segment(frame), some = normal.segment(frame);
    EXPECT_EQ(test::count_not_in(some, all), 0u);
    const hull::ObjectPixels object =
        hull::true_object_pixels(test::synthetic_object(world, frame / 30.0),
                                 config::published_camera(camera), hull::PixelRule::center);
    // A thousandth of the object has the colour of its background.
    EXPECT_LE(test::count_not_in(object, all), object.count() / 1000);
  }
}

TEST(Segmentation, ObjectsAreOnlySearchedInTheGivenPixels) {
  Plain plain;
  plain.fill({10, 10, 100, 40}, Plain::kOther);
  hull::ObjectPixels within(150, 60);
  for (int v = 5; v < 30; ++v) within.set_run(60, 90, v);
  config::SegmentationConfig config;
  config.closing_px = 3;
  EXPECT_EQ(plain.segmenter(config, within).segment(plain.image)->object.bounds(),
            (hull::PixelRect{60, 10, 90, 30}));
}

// Each threshold of the configuration, alone.
TEST(Segmentation, EachThresholdDecides) {
  const auto found = [](int levels, const config::SegmentationConfig& changed) {
    config::SegmentationConfig config = changed;
    config.hysteresis = 1;
    config.gain_compensation = false;
    Plain plain;
    plain.add({10, 10, 40, 40}, levels);
    return plain.object(config).count();
  };
  config::SegmentationConfig config;
  config.jitter_px = 0;
  EXPECT_EQ(found(8, config), 0u) << "4 sigmas of 2 levels, and the floor";
  EXPECT_EQ(found(9, config), 1600u);
  config.threshold_sigmas = 6;
  EXPECT_EQ(found(12, config), 0u);
  EXPECT_EQ(found(13, config), 1600u);
  config.threshold_ceiling_levels = 10;
  EXPECT_EQ(found(10, config), 0u);
  EXPECT_EQ(found(11, config), 1600u);
  config.threshold_floor_levels = 20;
  EXPECT_EQ(found(20, config), 0u);
  EXPECT_EQ(found(21, config), 1600u);
}

TEST(Segmentation, JitterToleratesAMovedEdge) {
  const auto moved = [](double jitter_px) {
    cv::Mat room(60, 150, CV_8UC3, cv::Scalar::all(60)), image = room.clone();
    room(cv::Rect(70, 0, 80, 60)).setTo(160);
    image(cv::Rect(71, 0, 79, 60)).setTo(160);
    config::SegmentationConfig config;
    config.jitter_px = jitter_px;
    config.shadow_min_brightness = 1;
    config.min_object_px = 0;
    return Segmenter(learn_background({&room, 1}), config).segment(image)->object.count();
  };
  EXPECT_EQ(moved(0), 60u);
  EXPECT_EQ(moved(2), 0u) << "twice the gradient of 50 levels per pixel";
}

// A wall becomes 30 levels brighter within a minute. The background follows, except beside an
// object, whose own pixels never become background. `conservative` keeps the learned background.
TEST(Segmentation, TheBackgroundFollowsSlowChangesAwayFromObjects) {
  config::SegmentationConfig config;
  config.gain_compensation = false;
  config.adaptation_s = 5;
  const auto left = [&](double adaptation_s, bool conservative = false) {
    config.adaptation_s = adaptation_s;
    config.conservative = conservative;
    Plain plain(150, 80);
    plain.fill({4, 4, 10, 10}, Plain::kOther);
    Segmenter segmenter = plain.segmenter(config);
    segmenter.set_period_s(0.1);
    std::optional<hull::ObjectPixels> found;
    for (int i = 0; i < 600; ++i) {
      if (i % 20 == 0) plain.add({80, 0, 70, 80}, 1);
      found = segmenter.segment(plain.image)->object;
    }
    return found.value();
  };
  EXPECT_EQ(left(5).count(), 100u);
  EXPECT_EQ(left(5).bounds(), (hull::PixelRect{4, 4, 14, 14}));
  EXPECT_EQ(left(0).count(), 100u + 70u * 80u);
  EXPECT_GE(left(5, true).count(), 100u + 70u * 80u);
}

// A column near an object keeps its background: one at a distance of 11 px, not one at 21 px.
TEST(Segmentation, TheBackgroundBesideAnObjectStays) {
  config::SegmentationConfig config;
  config.adaptation_s = 1;
  config.hysteresis = 1;
  config.min_object_px = 0;
  const auto is_object_after_a_slow_change = [&](int column) {
    Plain plain(150, 80);
    plain.fill({4, 4, 10, 10}, Plain::kOther);
    Segmenter segmenter = plain.segmenter(config);
    segmenter.set_period_s(0.1);
    std::optional<hull::ObjectPixels> found;
    for (int i = 0; i < 400; ++i) {
      if (i % 20 == 0) plain.add({column, 4, 1, 10}, 1);
      found = segmenter.segment(plain.image)->object;
    }
    return found->contains(column, 8);
  };
  EXPECT_TRUE(is_object_after_a_slow_change(24));
  EXPECT_FALSE(is_object_after_a_slow_change(34));
}

// The light doubles, beyond the largest gain that is compensated. What the object hides becomes
// brighter, too.
TEST(Segmentation, AdaptationFollowsTheLight) {
  config::SegmentationConfig config;
  config.adaptation_s = 5;
  Plain plain(150, 80);
  const cv::Mat empty = plain.image.clone();
  Segmenter segmenter = plain.segmenter(config);
  plain.fill({40, 30, 10, 10}, Plain::kOther);
  constexpr int kImages = 6000;  // 200 s
  cv::Mat image;
  for (int i = 0; i <= kImages; ++i) {
    plain.image.convertTo(image, -1, 1 + double(i) / kImages);
    const auto found = segmenter.segment(image);
    ASSERT_EQ(found->object.count(), 100u) << i;
    ASSERT_EQ(found->object.bounds(), (hull::PixelRect{40, 30, 50, 40}));
  }
  empty.convertTo(image, -1, 2);
  EXPECT_EQ(segmenter.segment(image)->object.count(), 0u);
  // The light of the start is as far from this background as the largest gain allows.
  empty.convertTo(image, -1, 1.4);
  EXPECT_EQ(segmenter.segment(image)->object.count(), 0u);
}

// A room with another level at each pixel, so that a small change of the light moves some.
cv::Mat varied_room() {
  cv::Mat room(80, 150, CV_8UC3);
  cv::RNG(3).fill(room, cv::RNG::UNIFORM, 100, 160);
  return room;
}

// Two hours of light that becomes brighter by a third. The background follows within a minute, so
// that it is never behind by a change that is visible in an image.
TEST(Segmentation, AdaptationFollowsSlowLightAlsoBehindObjects) {
  config::SegmentationConfig config;
  config.adaptation_s = 20;
  config.jitter_px = 0;
  const cv::Mat room = varied_room();
  Segmenter segmenter(learn_background({&room, 1}), config);
  segmenter.set_period_s(0.5);
  constexpr int kImages = 2 * 2 * 3600;
  constexpr double kBrighter = 1.0 / 3;
  cv::Mat image;
  for (int i = 0; i <= kImages; ++i) {
    room.convertTo(image, -1, 1 + kBrighter * i / kImages);
    image(cv::Rect(40, 30, 10, 10)).setTo(cv::Scalar(250, 10, 10));
    ASSERT_EQ(segmenter.segment(image)->object.count(), 100u) << i;
  }
  room.convertTo(image, -1, 1 + kBrighter);
  EXPECT_EQ(segmenter.segment(image)->object.count(), 0u);
}

// The rows of the background take a change of the light one after the other.
TEST(Segmentation, AdaptationToASuddenChangeOfTheLightIsInvisible) {
  config::SegmentationConfig config;
  config.adaptation_s = 0.1;
  Plain plain(150, 80);
  Segmenter segmenter = plain.segmenter(config);
  segmenter.set_period_s(0.1);
  plain.image *= 0.7;
  for (int i = 0; i < 64 * 50; ++i)
    ASSERT_EQ(segmenter.segment(plain.image)->object.count(), 0u) << i;
}

// Leaves that move before a wall now and then, in a light that becomes brighter by 30 %, and darker
// again.
TEST(Segmentation, TheColoursOfAMovingBackgroundFollowTheLight) {
  for (const int images : {6000, 12000, 60000}) {
    config::SegmentationConfig config;
    config.adaptation_s = 5;
    const cv::Mat room = varied_room()(cv::Rect(0, 0, 80, 40)).clone();
    Background background = learn_background({&room, 1});
    const cv::Rect leaves(60, 20, 12, 12);
    for (int v = leaves.y; v < leaves.br().y; ++v)
      for (int u = leaves.x; u < leaves.br().x; ++u)
        background.moving.push_back({v * room.cols + u, {{{45, 145, 25}, {55, 155, 35}}}});
    Segmenter segmenter(background, config);
    cv::Mat with_leaves = room.clone(), image;
    with_leaves(leaves).setTo(cv::Scalar(50, 150, 30));
    for (int i = 0; i <= 2 * images; ++i) {
      const double light = 1 + 0.3 * (i <= images ? i : 2 * images - i) / images;
      (i % 97 == 0 ? with_leaves : room).convertTo(image, -1, light);
      ASSERT_EQ(segmenter.segment(image)->object.count(), 0u) << i;
    }
  }
}

TEST(Segmentation, DiagnosesMapsWithAllAndWithNoPixels) {
  const cv::Mat plate(33, 71, CV_8UC3, cv::Scalar(100, 100, 100)),
      other(33, 71, CV_8UC3, cv::Scalar(10, 220, 100));
  Segmenter segmenter(learn_background({&plate, 1}), {});
  EXPECT_EQ(segmenter.segment(other)->object.count(), 71u * 33u);
  EXPECT_EQ(segmentation_diagnostics(segmenter.segment(other)->object).size(), 1u);
  EXPECT_EQ(segmenter.segment(plate)->object.count(), 0u);
  EXPECT_EQ(segmentation_diagnostics(segmenter.segment(plate)->object).size(), 1u);
}

TEST(Segmentation, Diagnostics) {
  const auto diagnostics = [](int set) {
    hull::ObjectPixels pixels(50, 20);
    for (int i = 0; i < set; ++i) pixels.set(i % 50, i / 50);
    const std::vector<std::string> found = segmentation_diagnostics(pixels);
    return found.empty() ? "" : found.at(0);
  };
  EXPECT_EQ(diagnostics(0), "no object pixels: the hull is empty");
  hull::ObjectPixels some(50, 20);
  for (const bool any : {false, true}) {
    some.set(3, 4, any);
    EXPECT_EQ(
        segmentation_diagnostics(some, 1),
        std::vector<std::string>{"object pixels are outside the published image, so the hull is "
                                 "cut: in the rig, enlarge or remove `published` of the camera"});
  }
  EXPECT_EQ(diagnostics(1), "");
  EXPECT_EQ(diagnostics(600), "");
  for (const int set : {601, 1000})
    EXPECT_EQ(diagnostics(set),
              "more than 60 % of the image are object pixels: check exposure, light and camera "
              "position, then restart the node");
}

TEST(Segmentation, RejectsImagesOfOtherSizeOrType) {
  const cv::Mat plate(33, 71, CV_8UC3, cv::Scalar(100, 100, 100));
  Segmenter segmenter(learn_background({&plate, 1}), {});
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
  Segmenter segmenter(learn_background({&plate, 1}), {});
  EXPECT_EQ(segmenter.segment(image)->object.count(), 60u);
  EXPECT_EQ(segmenter.segment(image)->object.bounds(), (hull::PixelRect{60, 0, 65, 12}));
}

}  // namespace
}  // namespace fivepipe::capture
