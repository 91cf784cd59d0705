// Maps the captured image (with lens distortion) to the published pinhole image.
//
// Segmentation runs before, on the captured image, because its noise is independent per pixel and
// its reference is exact; interpolation would mix neighbouring pixels into every difference.
// Undistortion then moves one bit per pixel by nearest neighbour, and interpolates colours only in
// the region that the caller needs.
#pragma once
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "common/config/rig.h"
#include "common/hull/object_pixels.h"

namespace fivepipe::capture {

class Undistortion {
 public:
  explicit Undistortion(const config::RigCamera& camera);

  // Returns true if the captured image is the published one.
  bool identity() const { return identity_; }
  // Returns the published pixels whose source pixel is set. Pixels that the source does not see
  // stay unset. `source` must have the captured size.
  hull::ObjectPixels published(const hull::ObjectPixels& source) const;
  // Returns the part `region` of the published image by bilinear interpolation. Pixels that the
  // source does not see are black. `region` must be inside the published image.
  cv::Mat published(const cv::Mat& source_bgr, const hull::PixelRect& region) const;
  // Returns true if the captured image sees this published pixel.
  bool sees(int u_px, int v_px) const;

 private:
  // Smallest source rectangle that contains the source pixels of one word (64 published pixels).
  struct SourceRect {
    std::int32_t u0, v0, u1, v1;
  };
  bool identity_ = false;
  int source_width_px_ = 0, source_height_px_ = 0, width_px_ = 0, height_px_ = 0;
  // Per published pixel: index of its bit in the source map, rows padded to whole words.
  std::vector<std::int32_t> source_index_;
  std::vector<SourceRect> source_rects_;  // per published word
  cv::Mat position_, fraction_;           // CV_16SC2 and CV_16UC1, as cv::remap takes them
  static constexpr std::int32_t kUnseen = -1;
};

// Returns the normalised radius up to which the distorted radius increases with the undistorted
// one. Beyond it the radial model folds back, and its pixels do not show what the lens sees.
// Infinite if the model never folds.
double monotonic_radius(const config::LensDistortion& lens);

// OpenCV's lens model: maps normalised undistorted to normalised distorted coordinates.
Eigen::Vector2d distorted(const config::LensDistortion& lens, const Eigen::Vector2d& xy);

// Returns the normalised undistorted coordinates of a captured pixel, by fixed-point iteration on
// the lens model.
Eigen::Vector2d undistorted(const config::RigCamera& camera, const Eigen::Vector2d& uv_px);

}  // namespace fivepipe::capture
