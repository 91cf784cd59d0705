// Which part of a camera's image goes to those who colour the hull, and its colours.
#pragma once
#include <opencv2/core.hpp>
#include <vector>

#include "capture_node/lens/undistortion.h"
#include "common/config/deployment.h"
#include "common/hull/colour_region.h"
#include "common/hull/silhouette_bounds.h"

namespace fivepipe::capture {

// What the viewer's eye can see of the hull: its whole image, and a box around what is nearer than
// its far plane.
struct VisibleRegion {
  hull::SilhouetteBounds part;
  Eigen::AlignedBox3d box_m;
};
VisibleRegion visible_region(const config::Viewer& viewer, const Eigen::Isometry3d& eye_from_world);

// Pixels of the camera's image onto which points of the box project that are in all these parts and
// 1 cm in front of each camera, this one too; and those up to margin_px beside them. One convex
// part of the image, or none.
hull::ObjectPixels footprint(std::vector<hull::SilhouetteBounds> parts,
                             const Eigen::AlignedBox3d& box_m, const geometry::Camera& camera,
                             int margin_px);

// The colours of these pixels of the published image.
hull::ColourRegion colours_of(hull::ObjectPixels pixels, const geometry::Camera& camera,
                              const Undistortion& undistortion, const cv::Mat& captured_bgr);

}  // namespace fivepipe::capture
