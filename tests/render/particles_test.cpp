// Particles in the composite: their place, size, colour and depth.
#include <algorithm>
#include <cmath>

#include "tests/render/composite_fixture.h"
#include "tests/support/not_finite.h"

namespace fivepipe::render {
namespace {

constexpr double kRadius_m = 0.02;

class Particles : public Composite {
 protected:
  config::Scene scene_ = scene_of({plate("wall", 2, 8, 8)});
  geometry::Pinhole pinhole_ = config::render_pinhole(viewer_);

  void SetUp() override {
    scene_.objects[0].colour_rgb = {0.1, 0.1, 0.1};
    config::ParticleSource red, blue;
    red.name = "red", blue.name = "blue";
    red.radius_m = blue.radius_m = kRadius_m;
    red.colour_rgb = {0.9, 0.05, 0.05}, blue.colour_rgb = {0.05, 0.05, 0.9};
    scene_.particles = {red, blue};
  }
  cv::Mat with(const std::vector<ParticleCloud>& particles, const HullFrame& hull) const {
    Renderer renderer(scene_, viewer_);
    renderer.draw(hull, {}, {}, particles);
    return renderer.image_bgr();
  }
  cv::Mat with(const std::vector<ParticleCloud>& particles) const {
    return with(particles, empty_hull_);
  }
  // x and z of the world are right and up in the image; y is the depth.
  cv::Point pixel(double x_m, double y_m, double z_m) const {
    return {int(std::lround(pinhole_.cx_px + pinhole_.fx_px * x_m / y_m)),
            int(std::lround(pinhole_.cy_px - pinhole_.fy_px * z_m / y_m))};
  }
  static bool is_red(const cv::Vec3b& bgr) {
    return bgr[2] > 2 * std::max(bgr[0], bgr[1]) && bgr[2] > 40;
  }
  static bool is_blue(const cv::Vec3b& bgr) {
    return bgr[0] > 2 * std::max(bgr[1], bgr[2]) && bgr[0] > 40;
  }
};

TEST_F(Particles, AreDrawnAsBallsAtTheirPlaces) {
  const cv::Mat image = with({{0, {0.2f, 1, 0.1f, -0.3f, 1.5f, -0.2f}}, {1, {0.1f, 1, -0.2f}}});
  EXPECT_TRUE(is_red(image.at<cv::Vec3b>(pixel(0.2, 1, 0.1))));
  EXPECT_TRUE(is_red(image.at<cv::Vec3b>(pixel(-0.3, 1.5, -0.2))));
  EXPECT_TRUE(is_blue(image.at<cv::Vec3b>(pixel(0.1, 1, -0.2))));
  // The area of a disc of the ball's radius.
  int red_px = 0;
  const double radius_px = kRadius_m * pinhole_.fx_px;
  for (int v = 0; v < image.rows; ++v)
    for (int u = 0; u < image.cols; ++u) red_px += is_red(image.at<cv::Vec3b>(v, u));
  const double expected_px = M_PI * radius_px * radius_px * (1 + 1 / (1.5 * 1.5));
  EXPECT_NEAR(red_px, expected_px, 0.05 * expected_px);
}

// The image of a ball beside the view's axis is an ellipse, 1.2 times as long as wide at 33
// degrees.
TEST_F(Particles, CoverThePixelsWhoseRaysMeetThem) {
  for (const double tangent : {0.0, 0.2, 0.4}) {
    const double y_m = 0.4, x_m = tangent * y_m, z_m = 0.5 * x_m;
    const cv::Mat image = with({{0, {float(x_m), float(y_m), float(z_m)}}});
    int wrong = 0, covered = 0;
    for (int v = 0; v < image.rows; ++v)
      for (int u = 0; u < image.cols; ++u) {
        const Eigen::Vector3d ray = Eigen::Vector3d((u - pinhole_.cx_px) / pinhole_.fx_px, 1,
                                                    (pinhole_.cy_px - v) / pinhole_.fy_px)
                                        .normalized();
        const double across_m = ray.cross(Eigen::Vector3d(x_m, y_m, z_m)).norm();
        const double beside_px = std::abs(across_m - kRadius_m) / y_m * pinhole_.fx_px;
        covered += across_m < kRadius_m;
        if (beside_px < 0.02) continue;  // rounding of float
        wrong += is_red(image.at<cv::Vec3b>(v, u)) != (across_m < kRadius_m);
      }
    EXPECT_EQ(wrong, 0) << tangent;
    EXPECT_GT(covered, 100) << tangent;
  }
}

TEST_F(Particles, AreHiddenByNearerSurfacesAndHideOthers) {
  const std::vector<ParticleCloud> particles{{0, {0, 1, 0, 0, 2.5f, 0.3f}}};
  const cv::Mat image = with(particles);
  EXPECT_TRUE(is_red(image.at<cv::Vec3b>(pixel(0, 1, 0))));
  EXPECT_FALSE(is_red(image.at<cv::Vec3b>(pixel(0, 2.5, 0.3)))) << "behind the wall";
  for (const bool is_nearer : {true, false}) {
    // A ball reaches 2 cm towards the eye.
    const double depth_m = is_nearer ? 0.97 : 0.99;
    const HullFrame hull = test::hull_of(eye_, config::recon_pinhole(viewer_), &kHullBgr,
                                         [&](int, int) { return depth_m; });
    EXPECT_EQ(is_red(with(particles, hull).at<cv::Vec3b>(pixel(0, 1, 0))), !is_nearer);
  }
}

TEST_F(Particles, AreRoundAndLitFromTheLight) {
  scene_.light_world_m = {-2, 0.5, 2};
  scene_.particles[0].radius_m = 0.015;
  const cv::Mat image = with({{0, {0, 0.5f, 0}}});
  const auto red = [&](double x_m, double z_m) {
    return int(image.at<cv::Vec3b>(pixel(x_m, 0.5, z_m))[2]);
  };
  EXPECT_GT(red(-0.008, 0.008), red(0.008, -0.008) + 40);
  // Its corners show the wall.
  EXPECT_FALSE(is_red(image.at<cv::Vec3b>(pixel(0.0135, 0.5, 0.0135))));
}

TEST_F(Particles, SmallerThanAPixelStillShow) {
  scene_.particles[0].radius_m = 1e-4;
  const cv::Mat image = with({{0, {0.2f, 1, 0.1f}}});
  int red_px = 0;
  for (int v = 0; v < image.rows; ++v)
    for (int u = 0; u < image.cols; ++u) red_px += is_red(image.at<cv::Vec3b>(v, u));
  EXPECT_EQ(red_px, 1);
}

TEST_F(Particles, OfAnUnknownSourceOrWithBadCoordinatesAreUndrawable) {
  const Renderer renderer(scene_, viewer_);
  EXPECT_EQ(renderer.why_undrawable(ParticleCloud{1, {1, 2, 3}}), std::nullopt);
  EXPECT_EQ(renderer.why_undrawable(ParticleCloud{1, {}}), std::nullopt);
  EXPECT_EQ(renderer.why_undrawable(ParticleCloud{2, {1, 2, 3}}), "not in the scene");
  EXPECT_EQ(renderer.why_undrawable(ParticleCloud{0, {1, 2}}),
            "2 coordinates are not three per particle");
  for (const double bad : {test::kNaN, test::kInfinity})
    EXPECT_EQ(renderer.why_undrawable(ParticleCloud{0, {1, float(bad), 3}}), "particle not finite");
  EXPECT_EQ(renderer.why_undrawable(ParticleCloud{
                0, std::vector<float>(3 * std::size_t(config::kMaxSentParticles) + 3)}),
            "220001 particles are too many");
}

}  // namespace
}  // namespace fivepipe::render
