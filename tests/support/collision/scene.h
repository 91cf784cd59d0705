// Scenes for the tests of collision and simulation: an OpenGL context, cameras around the origin,
// and real objects as capsules.
#pragma once
#include <gtest/gtest.h>

#include <memory>
#include <numbers>
#include <utility>

#include "common/collision/detection/paper/paper_detection.h"
#include "tests/support/checked_gl_context.h"
#include "tests/support/hull/scenes.h"

namespace fivepipe::test {

// Makes an OpenGL context current for all tests of a suite.
class GlTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { context_ = std::make_unique<gl::GlContext>(); }
  static void TearDownTestSuite() { context_.reset(); }
  void TearDown() override { expect_no_gl_error(); }
  static inline std::unique_ptr<gl::GlContext> context_;
};

inline const Eigen::Vector3d kOrigin = Eigen::Vector3d::Zero();

// A camera whose image of size_px squared spans field_m at the target, so that a pixel's footprint
// there is field_m / size_px.
inline geometry::Camera camera_at(const Eigen::Vector3d& eye_m, int size_px, double field_m,
                                  const Eigen::Vector3d& target_m = kOrigin,
                                  const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ()) {
  return {geometry::pinhole_from_fov(size_px, size_px,
                                     2 * std::atan(0.5 * field_m / (target_m - eye_m).norm())),
          geometry::look_at(eye_m, target_m, up)};
}

// `count` cameras at equal angles around the z axis, elevation_rad above the target's horizon.
inline std::vector<geometry::Camera> ring(int count, double distance_m, double elevation_rad,
                                          int size_px, double field_m,
                                          const Eigen::Vector3d& target_m = kOrigin) {
  std::vector<geometry::Camera> cameras;
  for (int i = 0; i < count; ++i) {
    const double a = 2 * std::numbers::pi * i / count;
    const Eigen::Vector3d direction(std::cos(a) * std::cos(elevation_rad),
                                    std::sin(a) * std::cos(elevation_rad), std::sin(elevation_rad));
    cameras.push_back(camera_at(target_m + distance_m * direction, size_px, field_m, target_m));
  }
  return cameras;
}

inline hull::Capsule ball(const Eigen::Vector3d& center_m, double radius_m) {
  return {center_m, center_m, radius_m};
}

// A camera at the origin that looks along z. Pixel 35,000 begins at x = 0, pixel 32 at y = 0, and a
// pixel is 1/64 m at a depth of 1 m. Float cannot represent pixels in 70,000 columns. In `rows`
// [begin, end), the pixels with x < -(35,000 - 10) / 64 m and x > 10 / 64 m at this depth are
// object pixels.
inline hull::Silhouette too_wide_for_float(std::pair<int, int> rows) {
  hull::Silhouette wide{{{70'000, 64, 64, 64, 34'999.5, 31.5}, Eigen::Isometry3d::Identity()},
                        hull::ObjectPixels(70'000, 64)};
  for (int v = rows.first; v < rows.second; ++v) {
    wide.pixels.set_run(0, 10, v);
    wide.pixels.set_run(35'010, 70'000, v);
  }
  return wide;
}

// A forearm and a finger below a ring of cameras, all moved by shift_m. A pixel's footprint is 2.5
// mm with images of 200 px.
inline std::vector<hull::Silhouette> hand_among(int cameras = 4, int size_px = 200,
                                                const Eigen::Vector3d& shift_m = kOrigin) {
  const Eigen::Vector3d elbow = shift_m + Eigen::Vector3d(-0.1, 0, 0),
                        palm = shift_m + Eigen::Vector3d(0.02, 0.01, 0.03);
  const Eigen::Vector3d finger = shift_m + Eigen::Vector3d(0.08, 0.05, 0.02);
  return silhouettes_of({{elbow, palm, 0.03}, {palm, finger, 0.012}},
                        ring(cameras, 1.2, 0.6, size_px, 0.5, shift_m));
}

// The pose that translates an object to p_world_m.
inline Eigen::Isometry3d at(const Eigen::Vector3d& p_world_m) {
  Eigen::Isometry3d world_from_object = Eigen::Isometry3d::Identity();
  world_from_object.translation() = p_world_m;
  return world_from_object;
}

}  // namespace fivepipe::test
