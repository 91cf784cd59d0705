// Fixture of the tests that draw scenes and read back the image.
#pragma once
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "render_node/renderer.h"
#include "tests/support/checked_gl_context.h"
#include "tests/support/render_scenes.h"

namespace fivepipe::render {

// Window depth is a float: half a unit in the last place at 1 is 3e-8. The factor z^2 / near maps
// this error to metres: 1.5e-5 m at 5 m with a near plane of 5 cm. The rounding of the vertices in
// clip space has the same size.
inline constexpr float kDepthRounding_m = 1e-4f;

inline const std::array<std::uint8_t, 3> kHullBgr = {10, 200, 90};
inline const cv::Vec3b kHullColour(10, 200, 90);

inline config::Viewer viewer(double near_m = 0.05, double far_m = 5.0) {
  config::Viewer v;
  v.near_m = near_m;
  v.far_m = far_m;
  return v;
}

inline config::Scene scene_of(std::vector<config::SceneObject> objects,
                              const Eigen::Vector3d& light_world_m = {0, -1, 2}) {
  config::Scene scene;
  scene.objects = std::move(objects);
  scene.light_world_m = light_world_m;
  return scene;
}

// Returns a thin plate that faces the eye of eye_along_y(), with its front at depth_m.
inline config::SceneObject plate(const std::string& name, double depth_m, double width_m,
                                 double height_m, double x_m = 0, double z_m = 0) {
  constexpr double kThickness_m = 1e-3;
  return test::object(name, config::BoxShape{{width_m, kThickness_m, height_m}},
                      {x_m, depth_m + kThickness_m / 2, z_m}, {0.8, 0.8, 0.8});
}

class Composite : public testing::Test {
 protected:
  test::CheckedGlContext context_;
  config::Viewer viewer_ = viewer();
  Eigen::Isometry3d eye_ = test::eye_along_y();
  HullFrame empty_hull_ = test::no_hull(eye_, config::recon_pinhole(viewer_));

  cv::Mat image(const config::Scene& scene, const HullFrame& hull,
                const std::set<std::string>& colliding = {}) const {
    Renderer renderer(scene, viewer_);
    renderer.draw(hull, {}, colliding);
    return renderer.image_bgr();
  }
};

inline int brightness(const cv::Vec3b& bgr) { return bgr[0] + bgr[1] + bgr[2]; }

}  // namespace fivepipe::render
