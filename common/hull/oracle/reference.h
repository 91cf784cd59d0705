// The exact reference for hull depth: each camera's epipolar line walked pixel by pixel into exact
// in/out intervals, the intervals of all cameras intersected (image-based visual hulls, Matusik et
// al. 2000, done exactly). Written for clarity, in double, slow; shares no code with the backends
// that are held against it.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "common/hull/hull.h"

namespace fivepipe::hull {

// Where the ray is on object pixels of this camera, in front of it, between near and far;
// ascending, disjoint, not touching.
std::vector<Interval> reference_intervals(const Silhouette& silhouette, const geometry::Ray& ray,
                                          double near, double far);

// Where the ray is in the hull; nothing where there is no camera.
std::vector<Interval> reference_intervals(std::span<const Silhouette> silhouettes,
                                          const geometry::Ray& ray, double near, double far,
                                          const HullRule& rule = {});

// Depth [m] of the first hull point through the view's pixel (u, v).
std::optional<double> reference_depth_m(std::span<const Silhouette> silhouettes, const View& view,
                                        int u_px, int v_px, const HullRule& rule = {});

}  // namespace fivepipe::hull
