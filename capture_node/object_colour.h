// Selects the pixels of a camera's image that can show the hull, and returns their colours.
#pragma once
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "capture_node/lens/undistortion.h"
#include "common/config/view/viewer.h"
#include "common/hull/colour_region.h"
#include "common/hull/hull.h"
#include "common/hull/silhouette_bounds.h"

namespace fivepipe::capture {

// The part of the world that one eye of the viewer can see: its reconstruction image (`part`), and
// a world box that contains every point of its view frustum up to the far plane which is in the
// hull's box; it may be empty.
struct VisibleRegion {
  hull::SilhouetteBounds part;
  Eigen::AlignedBox3d box_m;
};
VisibleRegion visible_region(
    const config::Viewer& viewer, const Eigen::Isometry3d& eye_from_world,
    const Eigen::AlignedBox3d& hull_box_m = hull::HullRule().within_world_m);

// Returns what each eye of the viewers can see at a time since the start.
std::vector<VisibleRegion> visible_regions(std::span<const config::Viewer> viewers, double t_s,
                                           const Eigen::AlignedBox3d& hull_box_m);

// Returns the pixels of `camera`'s image that can show a point of `box_m` which all `parts` and
// `camera` see at a depth of at least 1 cm, and all pixels within margin_px of these. The result is
// one convex region of the image, or empty.
hull::ObjectPixels footprint(std::vector<hull::SilhouetteBounds> parts,
                             const Eigen::AlignedBox3d& box_m, const geometry::Camera& camera,
                             int margin_px);

// Returns the pixels of `camera`'s image that can show a point which all `parts` and at least one
// eye see: the union of the footprints for each eye.
hull::ObjectPixels visible_footprint(const std::vector<hull::SilhouetteBounds>& parts,
                                     std::span<const VisibleRegion> eyes,
                                     const geometry::Camera& camera, int margin_px);

// Returns the colours of `pixels` of the published image. `captured_bgr`: 8-bit BGR of the captured
// size.
hull::ColourRegion colours_of(hull::ObjectPixels pixels, const geometry::Camera& camera,
                              const Undistortion& undistortion, const cv::Mat& captured_bgr);

}  // namespace fivepipe::capture
