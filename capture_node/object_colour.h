// Which part of a camera's image goes to those who colour the hull, and its colours.
#pragma once
#include <opencv2/core.hpp>
#include <vector>

#include "capture_node/undistortion.h"
#include "common/hull/colour_region.h"
#include "common/hull/hull_bounds.h"

namespace fivepipe {

// Pixels of the camera's image onto which the hull can project, as far as it is in the box and 1 cm in front of the camera, and those up to
// margin_px beside them: one convex part of the image, or none. `parts` are of the cameras that give shape.
ObjectPixels footprint(std::vector<SeenPart> parts, const Eigen::AlignedBox3d& box_m, const Camera& camera, int margin_px);

// The colours of these pixels of the published image.
ColourRegion colours_of(ObjectPixels pixels, const Camera& camera, const Undistortion& undistortion, const cv::Mat& captured_bgr);

}  // namespace fivepipe
