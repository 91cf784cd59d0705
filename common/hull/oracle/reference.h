// The exact reference for hull depth: walks each camera's epipolar line pixel by pixel into exact
// inside intervals and intersects the intervals of all cameras (image-based visual hulls, Matusik
// et al., 2000). Written for clarity, in double, slow. It shares no code with the backends that
// tests compare with it.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "common/hull/hull.h"

namespace fivepipe::hull {

// Intervals between near and far in which the ray is in front of the camera and on its object
// pixels; ascending, disjoint, not adjacent.
std::vector<Interval> reference_intervals(const Silhouette& silhouette, const geometry::Ray& ray,
                                          double near, double far);

// Intervals in which the ray is in the hull. Returns nothing if there is no camera.
std::vector<Interval> reference_intervals(std::span<const Silhouette> silhouettes,
                                          const geometry::Ray& ray, double near, double far,
                                          const HullRule& rule = {});

// Depth [m] of the first hull point on the ray through the view's pixel (u, v), or nullopt.
std::optional<double> reference_depth_m(std::span<const Silhouette> silhouettes, const View& view,
                                        int u_px, int v_px, const HullRule& rule = {});

}  // namespace fivepipe::hull
