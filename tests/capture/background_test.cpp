// The background: mean, noise, movement, and changes of brightness.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "capture_node/segmentation/background.h"
#include "capture_node/segmentation/gain.h"
#include "tests/support/capture/random_image.h"

namespace fivepipe::capture {
namespace {

using test::random_image;

const LearningSettings kUncompensated{false, 16, 0};

TEST(Background, IsRobustToTransientForeground) {
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
  const Background background = learn_background(frames, kUncompensated);
  double sigma_sum = 0;
  for (std::size_t i = 0; i < background.mean_levels.size(); ++i) {
    // Six standard errors of the mean of 28 samples.
    ASSERT_NEAR(background.mean_levels[i], 100 + 20 * double(i % 3), 6 * 3 / std::sqrt(28.0)) << i;
    sigma_sum += background.sigma_levels[i];
  }
  // Rounding adds 1/12 to the variance. Trimming by the median deviation of few samples sometimes
  // removes a few valid ones.
  EXPECT_NEAR(sigma_sum / double(background.sigma_levels.size()), std::sqrt(9 + 1 / 12.0), 0.15);
}

TEST(Background, MatchesTrimmedMeanForAnyFrameCount) {
  for (int n = 1; n <= 33; ++n) {
    std::vector<cv::Mat> frames;
    for (int f = 0; f < n; ++f) frames.push_back(random_image(5, 3, unsigned(100 * n + f)));
    const Background background = learn_background(frames, kUncompensated);
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
      ASSERT_NEAR(background.mean_levels[std::size_t(i)], sum / kept, 1e-4)
          << n << " frames, element " << i;  // float
    }
  }
}

// Mean and noise of the kept samples, by their definition, for images of several sizes.
TEST(Background, NoiseIsTheDeviationOfTheSamplesNearTheMedian) {
  for (const int n : {1, 7, 8, 9, 24}) {
    std::vector<cv::Mat> frames;
    std::mt19937 random{unsigned(n)};
    for (int f = 0; f < n; ++f) {
      cv::Mat frame(3, 17, CV_8UC3);
      for (int i = 0; i < 3 * 17 * 3; ++i) {
        const int spread = i % 7;  // 0: quiet, and some samples far off at the limits of the trim
        const int near = int(random() % unsigned(2 * spread + 1)) - spread,
                  far = random() % 9 == 0 ? int(random() % 60) - 30 : 0;
        frame.data[i] = std::uint8_t(100 + near + far);
      }
      frames.push_back(frame);
    }
    const Background background = learn_background(frames, kUncompensated);
    EXPECT_EQ(background.width_px, 17);
    EXPECT_EQ(background.height_px, 3);
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
      ASSERT_NEAR(background.mean_levels[i], mean, 1e-4) << n << ' ' << i;
      ASSERT_NEAR(background.sigma_levels[i],
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

TEST(Background, OnePictureHasTheAssumedNoise) {
  const cv::Mat plate = random_image(31, 5, 4);
  const Background background = learn_background({&plate, 1});
  for (std::size_t i = 0; i < background.mean_levels.size(); ++i) {
    ASSERT_EQ(background.mean_levels[i], plate.data[i]);
    ASSERT_EQ(background.sigma_levels[i], float(kPlateSigma_levels));
  }
}

constexpr int kFrames = 60;

// Frames of a room of one colour; draw(frame, n) changes them.
template <class Draw>
std::vector<cv::Mat> room(Draw draw, int frames = kFrames, double noise_levels = 1.5) {
  std::mt19937 random(8);
  std::normal_distribution<double> noise(0, noise_levels);
  std::vector<cv::Mat> result;
  for (int n = 0; n < frames; ++n) {
    cv::Mat frame(30, 70, CV_8UC3, cv::Scalar(90, 120, 160));
    draw(frame, n);
    for (int i = 0; i < 3 * 30 * 70; ++i)
      frame.data[i] = cv::saturate_cast<std::uint8_t>(frame.data[i] + noise(random));
    result.push_back(frame);
  }
  return result;
}

bool holds(const MovingPixel& pixel, const cv::Vec3b& level) {
  return std::any_of(pixel.boxes.begin(), pixel.boxes.end(), [&](const ColourBox& box) {
    bool inside = true;
    for (int c = 0; c < 3; ++c)
      inside &= level[c] >= box.low[std::size_t(c)] && level[c] <= box.high[std::size_t(c)];
    return inside;
  });
}

// A leaf swings between two colours. Its boxes hold the colours between these, and no other colour
// of the same range in each channel.
TEST(Background, AMovingPixelHasTheColoursItSwingsThrough) {
  const auto colour = [](double t) { return cv::Scalar(20 + 150 * t, 200 - 150 * t, 60 + 30 * t); };
  const auto frames = room([&](cv::Mat& frame, int n) {
    frame(cv::Rect(10, 5, 3, 2)).setTo(colour(0.5 + 0.5 * std::sin(1.1 * n)));
  });
  const Background background = learn_background(frames);
  ASSERT_EQ(background.moving.size(), 6u);
  EXPECT_EQ(background.moving[0].index, 5 * 70 + 10);
  EXPECT_EQ(background.moving[5].index, 6 * 70 + 12);
  for (const MovingPixel& pixel : background.moving) {
    EXPECT_EQ(pixel.boxes.size(), 4u);
    for (double t = 0; t <= 1; t += 0.02) {
      const cv::Scalar at = colour(t);
      EXPECT_TRUE(
          holds(pixel, cv::Vec3b(std::uint8_t(at[0]), std::uint8_t(at[1]), std::uint8_t(at[2]))))
          << t;
    }
    EXPECT_FALSE(holds(pixel, {20, 60, 60})) << "both channels low";
    EXPECT_FALSE(holds(pixel, {160, 190, 80})) << "both channels high";
    EXPECT_FALSE(holds(pixel, {90, 120, 160}));
  }
  LearningSettings one_colour;
  one_colour.moving_boxes = 0;
  EXPECT_TRUE(learn_background(frames, one_colour).moving.empty());
}

// A person who crosses twice, in a fifth of the frames, is not background.
TEST(Background, APersonWhoWalksPastDoesNotMakeItMoving) {
  const Background background = learn_background(room([](cv::Mat& frame, int n) {
    if ((n >= 10 && n < 16) || (n >= 40 && n < 46))
      frame(cv::Rect(20, 0, 20, 30)).setTo(cv::Scalar(30, 40, 50));
  }));
  EXPECT_TRUE(background.moving.empty());
  const std::size_t inside = 3 * (10 * 70 + 30);
  EXPECT_NEAR(background.mean_levels[inside], 90, 1.5);
  EXPECT_NEAR(background.sigma_levels[inside], 1.5, 0.6);
}

// Also if few frames are learned from: two runs are two people.
TEST(Background, TwoPeopleAreNoMovementInFewFrames) {
  for (const int frames : {8, 12, 24}) {
    const auto moving = [&](int runs) {
      return learn_background(room(
                                  [&](cv::Mat& frame, int n) {
                                    if (n % 2 == 1 && n / 2 < runs)
                                      frame.at<cv::Vec3b>(4, 4) = {200, 30, 30};
                                  },
                                  frames))
          .moving.size();
    };
    EXPECT_EQ(moving(2), 0u) << frames;
    EXPECT_EQ(moving(3), 1u) << frames;
  }
}

// Movement must be frequent: in a tenth of the frames, and in a run of its own every twelve frames.
TEST(Background, MovementReturnsAgainAndAgain) {
  const auto moving = [](auto is_away) {
    return learn_background(room([&](cv::Mat& frame, int n) {
             if (is_away(n)) frame.at<cv::Vec3b>(4, 4) = {200, 30, 30};
           }))
        .moving.size();
  };
  EXPECT_EQ(moving([](int n) { return n % 10 == 0; }), 1u);           // 6 frames, 6 runs
  EXPECT_EQ(moving([](int n) { return n % 12 == 0; }), 0u);           // 5 frames
  EXPECT_EQ(moving([](int n) { return n % 12 < 2; }), 1u);            // 10 frames, 5 runs
  EXPECT_EQ(moving([](int n) { return n < 45 && n % 12 < 3; }), 0u);  // 12 frames, 4 runs
  EXPECT_EQ(moving([](int n) { return n % 12 < 7; }), 1u) << "the room is the minority";
}

// The light flickers by 6 % while the background is learned. The noise does not include it.
TEST(Background, FlickerIsNoNoise) {
  const auto flickering = [](cv::Mat& frame, int n) {
    frame.convertTo(frame, -1, 1 + 0.06 * std::sin(2.1 * n));
  };
  const auto mean_sigma = [](const Background& background) {
    double sum = 0;
    for (const float sigma : background.sigma_levels) sum += double(sigma);
    return sum / double(background.sigma_levels.size());
  };
  EXPECT_NEAR(mean_sigma(learn_background(room(flickering))), 1.5, 0.2);
  EXPECT_GT(mean_sigma(learn_background(room(flickering), kUncompensated)), 4);
}

TEST(Gain, FindsTheBrightnessOfEachChannelBesideAnObjectAndAShadow) {
  const cv::Mat plate = random_image(90, 60, 3);
  std::vector<Levels> levels;
  const std::vector<cv::Point> grid = gain_grid(90, 60);
  EXPECT_GT(grid.size(), 900u);
  EXPECT_LE(grid.size(), 1200u);
  for (const cv::Point& at : grid) {
    ASSERT_TRUE(cv::Rect(0, 0, 90, 60).contains(at));
    const auto* pixel = plate.ptr(at.y) + 3 * at.x;
    levels.push_back({float(pixel[0]), float(pixel[1]), float(pixel[2])});
  }
  const GainEstimator estimator(grid, levels);
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 2);
  for (const Gain& gain :
       std::vector<Gain>{{1, 1, 1}, {0.9, 1.1, 1.2}, {1.06, 0.95, 1}, {0.7, 0.7, 0.7}}) {
    cv::Mat image(60, 90, CV_8UC3);
    for (int v = 0; v < 60; ++v)
      for (int u = 0; u < 90; ++u)
        for (int c = 0; c < 3; ++c) {
          const double shade = u < 18 ? 0.6 : 1;  // a fifth of the image
          image.ptr(v)[3 * u + c] = cv::saturate_cast<std::uint8_t>(
              plate.ptr(v)[3 * u + c] * gain[std::size_t(c)] * shade + noise(random));
        }
    image(cv::Rect(50, 0, 30, 60)).setTo(cv::Scalar(40, 90, 200));  // a third
    const Gain found = estimator.gain(image);
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(found[c], gain[c], 0.006) << c;
  }
  // No ratio is frequent: the camera has moved.
  for (const double gain : estimator.gain(random_image(90, 60, 4))) EXPECT_EQ(gain, 1);
  // All levels are dark, saturated, or beyond the largest gain.
  for (const int level : {0, 10, 255}) {
    const cv::Mat image(60, 90, CV_8UC3, cv::Scalar::all(level));
    for (const double gain : estimator.gain(image)) EXPECT_EQ(gain, 1) << level;
  }
  const GainEstimator none({}, {});
  EXPECT_EQ(none.gain(plate), (Gain{1, 1, 1}));
}

TEST(Gain, InvisibleChangesAreNoneWhereTheyAreCompensated) {
  EXPECT_EQ(visible({1.0019, 0.9981, 1}), (Gain{1, 1, 1}));
  EXPECT_EQ(visible({1.003, 0.997, 1.2}), (Gain{1.003, 0.997, 1.2}));
}

TEST(Gain, CompensationDividesAndRounds) {
  for (const double gain : {0.67, 0.9, 1.0, 1.01, 1.5}) {
    const GainTables tables = compensating_tables({gain, gain, gain});
    for (int level = 0; level < 256; ++level)
      ASSERT_NEAR(tables[1][std::size_t(level)], std::min(255.0, level / gain), 0.63)
          << level << " / " << gain;
  }
  for (int level = 0; level < 256; ++level)
    EXPECT_EQ(compensated(std::uint8_t(level), kNoGain[0]), level);
}

}  // namespace
}  // namespace fivepipe::capture
