// From the image as captured (with the lens's distortion) to the published pinhole.
// Segmentation happens before, in the image as captured: there noise is independent per pixel and
// the reference is exact, whereas an interpolated image would mix neighbours into every difference.
// What is moved is then one bit per pixel, by nearest neighbour, and colour only inside the region
// that is wanted.
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

  // The captured image is the published one.
  bool identity() const { return identity_; }
  // Published pixels whose source pixel is set. Pixels that the source does not see are not.
  hull::ObjectPixels published(const hull::ObjectPixels& source) const;
  // The part `region` of the published image, bilinear; black where the source does not see. The
  // region lies inside the image.
  cv::Mat published(const cv::Mat& source_bgr, const hull::PixelRect& region) const;
  // The captured image sees this published pixel.
  bool sees(int u_px, int v_px) const;

 private:
  // Smallest source rectangle from which the 64 published pixels of one word come.
  struct SourceRect {
    std::int32_t u0, v0, u1, v1;
  };
  bool identity_ = false;
  int source_width_px_ = 0, source_height_px_ = 0, width_px_ = 0, height_px_ = 0;
  std::vector<std::int32_t>
      source_index_;  // per published pixel: its bit in the source map, rows padded to whole words
  std::vector<SourceRect> source_rects_;  // per published word
  cv::Mat position_, fraction_;           // CV_16SC2 and CV_16UC1, as cv::remap takes them
  static constexpr std::int32_t kUnseen = -1;
};

// Normalised radius up to which the radial model grows with the angle; beyond it folds back onto
// itself and its pixels are not what the lens sees. Infinite where it never folds.
double monotonic_radius(const config::LensDistortion& lens);

// OpenCV's lens model: normalised undistorted to normalised distorted coordinates.
Eigen::Vector2d distorted(const config::LensDistortion& lens, const Eigen::Vector2d& xy);

}  // namespace fivepipe::capture
