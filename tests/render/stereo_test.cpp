// Both eyes of a stereo viewer: each image is that of a viewer there, and the disparity of a ball
// of known depth is the analytic one.
#include <cmath>

#include "common/config/views.h"
#include "tests/render/composite_fixture.h"

namespace fivepipe::render {
namespace {

using Eigen::Vector3d;

constexpr double kEyes_m = 0.063;  // between the eyes

class Stereo : public Composite {
 protected:
  config::Viewer stereo_ = viewer_;
  int width_px_ = viewer_.render_width_px;

  Stereo() { stereo_.eye_distance_m = kEyes_m; }

  Eigen::Isometry3d eye(int number) const {
    return config::eye_at(config::eye_positions_m(stereo_).at(std::size_t(number)), eye_);
  }
  // The hull of a ball as each eye sees it; of no hull if the radius is 0.
  std::vector<HullFrame> eyes(const Vector3d& center_m = {0, 1, 0}, double radius_m = 0) const {
    std::vector<HullFrame> eyes;
    const geometry::Pinhole recon = config::recon_pinhole(stereo_);
    for (const int number : {0, 1}) {
      const geometry::Camera camera{recon, eye(number)};
      eyes.push_back(
          radius_m == 0
              ? test::no_hull(camera.camera_from_world, recon)
              : test::hull_of(camera.camera_from_world, recon, &kHullBgr, [&](int u, int v) {
                  return test::ball_depth_m(camera, u, v, center_m, radius_m);
                }));
    }
    return eyes;
  }
  cv::Mat of_eye(const cv::Mat& image, int number) const {
    return image.colRange(number * width_px_, (number + 1) * width_px_);
  }
};

// The number of pixels of which a channel differs by more than 2 levels.
int different_pixels(const cv::Mat& a, const cv::Mat& b) {
  int different = 0;
  for (int v = 0; v < a.rows; ++v)
    for (int u = 0; u < a.cols; ++u) {
      const cv::Vec3b p = a.at<cv::Vec3b>(v, u), q = b.at<cv::Vec3b>(v, u);
      different +=
          std::abs(p[0] - q[0]) > 2 || std::abs(p[1] - q[1]) > 2 || std::abs(p[2] - q[2]) > 2;
    }
  return different;
}

// The scene has everything that is drawn: shadows, a coloured hull, objects, and particles at the
// borders of both images, which must not reach into the other one.
TEST_F(Stereo, EachEyeSeesWhatAViewerThereSees) {
  config::Scene scene = scene_of(
      {plate("wall", 2, 8, 8),
       test::object("ball", config::SphereShape{0.1, 4}, {0.2, 1.2, 0.1}, {0.8, 0.3, 0.2})},
      {-0.5, 0.1, 0.8});
  scene.shadows.emplace();
  scene.shadows->target_world_m = {0, 1.5, 0};
  scene.shadows->fov_rad = 1.6;
  config::ParticleSource grains;
  grains.name = "grains";
  grains.radius_m = 0.05;
  scene.particles = {grains};
  // At the right border of the left eye's image, and at the left border of the right eye's.
  const double at_border_m = 0.5 * std::tan(0.5) - 0.5 * kEyes_m - 0.005;
  const ParticleCloud cloud{0, {float(at_border_m), 0.5f, 0.1f, -float(at_border_m), 0.5f, -0.1f}};
  const std::vector<HullFrame> hulls = eyes({-0.15, 0.9, -0.1}, 0.12);
  Renderer both(scene, stereo_);
  both.draw(hulls, {}, {"ball"}, {{cloud}});
  const cv::Mat image = both.image_bgr();
  ASSERT_EQ(image.size(), cv::Size(2 * width_px_, viewer_.render_height_px));
  for (const int number : {0, 1}) {
    Renderer one(scene, viewer_);
    one.draw(hulls[std::size_t(number)], {}, {"ball"}, {{cloud}});
    // The offset of an image rounds its coordinates differently: some pixels at edges may differ.
    EXPECT_LE(different_pixels(of_eye(image, number), one.image_bgr()), 30) << number;
  }
  EXPECT_GT(different_pixels(of_eye(image, 0), of_eye(image, 1)), 10'000);
}

// Columns in which the row through the ball's center shows it: first and last.
std::pair<int, int> shown_columns(const cv::Mat& image, int row, const cv::Mat& without) {
  std::pair<int, int> columns{-1, -1};
  for (int u = 0; u < image.cols; ++u) {
    const cv::Vec3b p = image.at<cv::Vec3b>(row, u), q = without.at<cv::Vec3b>(row, u);
    if (std::abs(p[0] - q[0]) + std::abs(p[1] - q[1]) + std::abs(p[2] - q[2]) < 30) continue;
    if (columns.first < 0) columns.first = u;
    columns.second = u;
  }
  return columns;
}

// In the plane of the axes, a ball whose center is at the angle a and the distance d from the eye
// spans the angles from a - asin(r / d) to a + asin(r / d). The disparity of its center is
// f * kEyes_m / depth.
TEST_F(Stereo, ABallHasTheAnalyticDisparity) {
  constexpr double kRealRadius_m = 0.06;
  const geometry::Pinhole pinhole = config::render_pinhole(stereo_);
  const int row = viewer_.render_height_px / 2;
  for (const double depth_m : {0.5, 1.0, 2.0})
    for (const bool is_hull : {false, true}) {
      const Vector3d center_m(0.02, depth_m, 0);
      config::Scene scene = scene_of({}), with_ball = scene_of({});
      with_ball.objects = {
          test::object("ball", config::SphereShape{kRealRadius_m, 5}, center_m, {0.9, 0.9, 0.9})};
      Renderer empty(scene, stereo_), renderer(is_hull ? scene : with_ball, stereo_);
      empty.draw(eyes(), {}, {});
      renderer.draw(is_hull ? eyes(center_m, kRealRadius_m) : eyes(), {}, {});
      const cv::Mat without = empty.image_bgr(), image = renderer.image_bgr();
      double middle_px[2];
      for (const int number : {0, 1}) {
        const double x_m = center_m.x() + (number == 0 ? kEyes_m / 2 : -kEyes_m / 2),
                     angle = std::atan2(x_m, depth_m),
                     half = std::asin(kRealRadius_m / std::hypot(x_m, depth_m));
        const auto [first, last] =
            shown_columns(of_eye(image, number), row, of_eye(without, number));
        // The hull's border is that of a pixel of the reconstruction, which covers two.
        const double tolerance_px = is_hull ? 2.1 : 1.1;
        EXPECT_NEAR(first - 0.5, pinhole.cx_px + pinhole.fx_px * std::tan(angle - half),
                    tolerance_px);
        EXPECT_NEAR(last + 0.5, pinhole.cx_px + pinhole.fx_px * std::tan(angle + half),
                    tolerance_px);
        middle_px[number] = 0.5 * (first + last);
      }
      const double disparity_px = middle_px[0] - middle_px[1],
                   analytic_px = pinhole.fx_px * kEyes_m / depth_m;
      std::printf("%s at %.1f m: disparity %.1f px, analytic %.2f px\n", is_hull ? "hull" : "ball",
                  depth_m, disparity_px, analytic_px);
      // The middle of the ball's span is not its center: the span widens to the side by less than
      // f * (r / depth)^2 * tan(a), here 0.6 px at 0.5 m.
      EXPECT_NEAR(disparity_px, analytic_px, is_hull ? 3 : 2) << depth_m;
      EXPECT_GT(disparity_px, 0) << "the left eye's image is at the left";
    }
}

}  // namespace
}  // namespace fivepipe::render
