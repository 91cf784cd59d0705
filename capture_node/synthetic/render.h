// Renders images of the synthetic world as a camera would capture them, with lens distortion,
// shading and cast shadow, but without noise. Casts rays through the pixel centers of the captured
// image. Renders the room of a fixed camera once, and per frame only the pixels that the object or
// its shadow can cover.
#pragma once
#include <limits>
#include <memory>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "capture_node/synthetic/surroundings.h"
#include "capture_node/synthetic/world.h"
#include "common/config/rig.h"

namespace fivepipe::capture {

// Returns the camera with n captured pixels along each axis of one. mean_of_pixels() of its image
// has pixels that the object covers in part.
config::RigCamera with_finer_pixels(config::RigCamera camera, int n);
// Returns the image with the mean of n x n pixels in one.
cv::Mat mean_of_pixels(const cv::Mat& fine, int n);

class SyntheticCamera {
 public:
  SyntheticCamera(const config::SyntheticWorld& world, const config::RigCamera& camera,
                  std::shared_ptr<const Surroundings> surroundings);

  // Returns the image of `parts` (none: the empty room) without noise, 8-bit BGR of the captured
  // size. Renders the room again if the pose differs from that of the last call.
  cv::Mat image(std::span<const SyntheticPart> parts, const Eigen::Isometry3d& camera_from_world);

 private:
  void render_room(const Eigen::Isometry3d& camera_from_world);
  void draw_object(std::span<const SyntheticPart> parts, cv::Mat& bgr);
  void draw_shadow(std::span<const SyntheticPart> parts, cv::Mat& bgr);
  hull::PixelRect image_bounds_of(std::span<const Eigen::Vector3d> centers_world_m,
                                  std::span<const double> radii_m) const;
  Eigen::Vector3f direction_world(int u_px, int v_px,
                                  const Eigen::Matrix3f& world_from_camera) const;

  config::SyntheticWorld world_;
  config::RigCamera camera_;
  std::shared_ptr<const Surroundings> surroundings_;
  std::vector<Eigen::Vector2f> xy_;  // normalised undistorted coordinates per captured pixel
  Eigen::AlignedBox2d seen_xy_;      // bounds of xy_
  Eigen::Isometry3d camera_from_world_;
  cv::Mat room_;
  std::vector<Surface> surface_;
  struct Nearest {
    float depth_m = std::numeric_limits<float>::infinity();
    int piece = -1;
  };
  std::vector<Nearest> nearest_;   // per pixel: scratch buffer of draw_object()
  std::vector<float> visibility_;  // per pixel: scratch buffer of draw_shadow()
};

}  // namespace fivepipe::capture
