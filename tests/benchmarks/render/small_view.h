// A view of a ball for the tests of the errors of drawn frames.
#pragma once
#include <gtest/gtest.h>

#include <cmath>

#include "benchmarks/render/errors/avatar.h"
#include "tests/support/checked_gl_context.h"
#include "tests/support/render_scenes.h"

namespace fivepipe::render_bench {

using Eigen::Vector3d;

inline const Vector3d kBall_m(0, 1, 0);
inline constexpr double kBallRadius_m = 0.15;

class SmallView : public testing::Test {
 protected:
  test::CheckedGlContext context_;
  config::Viewer viewer_ = [] {
    config::Viewer viewer;
    viewer.recon_width_px = viewer.render_width_px = 320;
    viewer.recon_height_px = viewer.render_height_px = 240;
    return viewer;
  }();
  Eigen::Isometry3d eye_ = test::eye_along_y();
  geometry::Camera image_{config::render_pinhole(viewer_), eye_};
  hull::View view_{{config::recon_pinhole(viewer_), eye_}, viewer_.near_m, viewer_.far_m};
  double px_mm_ = 1e3 * kBall_m.y() / image_.pinhole.fx_px;  // at the ball

  static std::vector<hull::Capsule> ball(const Vector3d& moved_m = Vector3d::Zero(),
                                         double radius_m = kBallRadius_m) {
    return {{kBall_m + moved_m, kBall_m + moved_m, radius_m}};
  }
  // Three cameras around the ball.
  static std::vector<hull::Silhouette> silhouettes() {
    std::vector<hull::Silhouette> made;
    for (const Vector3d& eye_m :
         {Vector3d(1.5, 1, 0.5), Vector3d(-1, 0, 0.8), Vector3d(0, 2.5, 0)}) {
      const geometry::Camera camera{geometry::pinhole_from_fov(300, 300, 0.5),
                                    geometry::look_at(eye_m, kBall_m)};
      made.push_back({camera, hull::true_object_pixels(ball(), camera, hull::PixelRule::center)});
    }
    return made;
  }
};

}  // namespace fivepipe::render_bench
