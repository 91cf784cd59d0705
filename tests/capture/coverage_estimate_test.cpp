#include "capture_node/segmentation/coverage_estimate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace fivepipe::capture {
namespace {

using Eigen::Vector3f;

constexpr int kImageWidth = 130, kImageHeight = 90;
const Vector3f kObject(60, 90, 180), kBackground(150, 140, 120);

// A disc as a camera with a box filter of one pixel sees it, with noise.
struct Disc {
  double u, v, radius;
  double coverage(int pu, int pv) const {
    constexpr int kSteps = 16;
    int in = 0;
    for (int i = 0; i < kSteps; ++i)
      for (int j = 0; j < kSteps; ++j)
        in += std::hypot(pu - 0.5 + (i + 0.5) / kSteps - u, pv - 0.5 + (j + 0.5) / kSteps - v) <=
              radius;
    return double(in) / (kSteps * kSteps);
  }
};

struct Scene {
  cv::Mat image = cv::Mat(kImageHeight, kImageWidth, CV_8UC3);
  hull::ObjectPixels object{kImageWidth,
                            kImageHeight};  // the pixels with at least `threshold` coverage
  std::vector<float> background;
  std::vector<double> coverage;
};

Scene scene_of(const Disc& disc, double sigma_levels, const Vector3f& of_object = kObject,
               double threshold = 0.2, unsigned seed = 1) {
  Scene scene;
  std::mt19937 random(seed);
  std::normal_distribution<float> noise(0, float(sigma_levels));
  for (int v = 0; v < kImageHeight; ++v)
    for (int u = 0; u < kImageWidth; ++u) {
      const double a = disc.coverage(u, v);
      scene.coverage.push_back(a);
      if (a >= threshold) scene.object.set(u, v);
      for (int c = 0; c < 3; ++c) {
        const float level = float(a) * of_object[c] + float(1 - a) * kBackground[c];
        const float seen = level + (sigma_levels > 0 ? noise(random) : 0);
        scene.image.ptr(v)[3 * u + c] = std::uint8_t(std::clamp(std::lround(seen), 0L, 255L));
        scene.background.push_back(kBackground[c]);
      }
    }
  return scene;
}

// Root mean square error of the pixels that the disc covers in part.
double rms_error(const hull::CoverageMap& map, const Scene& scene) {
  double sum = 0;
  int count = 0;
  for (int v = 0; v < kImageHeight; ++v)
    for (int u = 0; u < kImageWidth; ++u) {
      const double a = scene.coverage[std::size_t(v * kImageWidth + u)];
      if (a == 0 || a == 1) continue;
      sum += std::pow(map.at(u, v) / 255.0 - a, 2);
      ++count;
    }
  return std::sqrt(sum / count);
}

TEST(CoverageEstimate, IsThatOfTheMixtureOfBothColours) {
  for (const double radius : {12.3, 25.7, 38.2}) {
    const Scene scene = scene_of({64.3, 44.8, radius}, 0);
    for (const bool is_learned : {true, false}) {
      const BehindObjects behind{is_learned ? std::span<const float>(scene.background)
                                            : std::span<const float>()};
      const hull::CoverageMap map = estimated_coverage(scene.image, scene.object, behind);
      EXPECT_LT(rms_error(map, scene), 0.01) << radius << ' ' << is_learned;
    }
  }
}

// The binary map has an error of about 0.3.
TEST(CoverageEstimate, WithstandsNoise) {
  const Scene scene = scene_of({64.3, 44.8, 30.4}, 2);
  const hull::CoverageMap map = estimated_coverage(scene.image, scene.object, {scene.background});
  EXPECT_LT(rms_error(map, scene), 0.04);
  EXPECT_GT(rms_error(hull::CoverageMap::from_pixels(scene.object), scene), 0.25);
}

TEST(CoverageEstimate, FollowsTheGainOfTheImage) {
  Scene scene = scene_of({64.3, 44.8, 30.4}, 0);
  scene.image.convertTo(scene.image, -1, 1.2);
  const hull::CoverageMap map =
      estimated_coverage(scene.image, scene.object, {scene.background, Vector3f::Constant(1.2f)});
  EXPECT_LT(rms_error(map, scene), 0.01);
}

// The segmentation is a pixel too wide, or too narrow: the border stays beside it.
TEST(CoverageEstimate, MovesTheBorderByAtMostOnePixel) {
  const Disc disc{64.3, 44.8, 30.4};
  for (const double wrong : {-3.0, -1.0, 0.0, 1.0, 3.0}) {
    Scene scene = scene_of(disc, 2);
    const Scene other = scene_of({disc.u, disc.v, disc.radius + wrong}, 0);
    const hull::CoverageMap map = estimated_coverage(scene.image, other.object, {scene.background});
    for (int v = 1; v + 1 < kImageHeight; ++v)
      for (int u = 1; u + 1 < kImageWidth; ++u) {
        int around = 0;
        for (int dv = -1; dv <= 1; ++dv)
          for (int du = -1; du <= 1; ++du) around += other.object.contains(u + du, v + dv);
        if (around == 9) {
          EXPECT_GE(map.at(u, v), 128) << u << ' ' << v;
        }
        if (!other.object.contains(u, v)) {
          EXPECT_LE(map.at(u, v), 127) << u << ' ' << v;
        }
        if (around == 0) {
          EXPECT_EQ(map.at(u, v), 0) << u << ' ' << v;
        }
      }
  }
}

TEST(CoverageEstimate, WithoutContrastOrInsideIsBinary) {
  const Scene pale = scene_of({64.3, 44.8, 30.4}, 2, kBackground + Vector3f::Constant(10));
  EXPECT_EQ(estimated_coverage(pale.image, pale.object, {pale.background}),
            hull::CoverageMap::from_pixels(pale.object));
  // A wire of two pixels has no pixel with neighbours of the object all around.
  const Scene image = scene_of({64.3, 44.8, 30.4}, 0);
  hull::ObjectPixels wire(kImageWidth, kImageHeight);
  for (const int v : {40, 41}) wire.set_run(10, 120, v);
  EXPECT_EQ(estimated_coverage(image.image, wire, {image.background}),
            hull::CoverageMap::from_pixels(wire));
  const hull::ObjectPixels none(kImageWidth, kImageHeight);
  EXPECT_EQ(estimated_coverage(image.image, none, {}),
            hull::CoverageMap(kImageWidth, kImageHeight));
  hull::ObjectPixels all(kImageWidth, kImageHeight);
  for (int v = 0; v < kImageHeight; ++v) all.set_run(0, kImageWidth, v);
  EXPECT_EQ(estimated_coverage(image.image, all, {}), hull::CoverageMap::from_pixels(all));
}

// A quarter turn of the image turns the coverage.
TEST(CoverageEstimate, DoesNotDependOnTheDirection) {
  const Scene scene = scene_of({44.8, 44.8, 30.4}, 2);
  const hull::CoverageMap map = estimated_coverage(scene.image, scene.object, {scene.background});
  cv::Mat turned(kImageWidth, kImageHeight, CV_8UC3);
  hull::ObjectPixels object(kImageHeight, kImageWidth);
  for (int v = 0; v < kImageHeight; ++v)
    for (int u = 0; u < kImageWidth; ++u) {
      turned.at<cv::Vec3b>(u, kImageHeight - 1 - v) = scene.image.at<cv::Vec3b>(v, u);
      object.set(kImageHeight - 1 - v, u, scene.object.contains(u, v));
    }
  const hull::CoverageMap of_turned = estimated_coverage(turned, object, {scene.background});
  for (int v = 0; v < kImageHeight; ++v)
    for (int u = 0; u < kImageWidth; ++u)
      EXPECT_NEAR(of_turned.at(kImageHeight - 1 - v, u), map.at(u, v), 1) << u << ' ' << v;
}

}  // namespace
}  // namespace fivepipe::capture
