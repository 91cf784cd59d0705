// The exact reference for hull depth: walks each camera's epipolar line pixel by pixel into exact
// inside intervals and intersects the intervals of all cameras (image-based visual hulls, Matusik
// et al., 2000). It computes in double and prefers clarity to speed. It shares no code with the
// backends that tests compare with it.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "common/hull/hull.h"

namespace fivepipe::hull {

// Returns the intervals between the ray parameters near and far in which the ray is in front of the
// camera and on its object pixels. They are ascending, disjoint and not adjacent.
std::vector<Interval> reference_intervals(const Silhouette& silhouette, const geometry::Ray& ray,
                                          double near, double far);

// Returns the intervals in which the ray is in the hull. There is none if there is no camera.
std::vector<Interval> reference_intervals(std::span<const Silhouette> silhouettes,
                                          const geometry::Ray& ray, double near, double far,
                                          const HullRule& rule = {});

// Returns the depth [m] of the first hull point on the ray through the view's pixel (u, v), or
// nullopt if it meets none.
std::optional<double> reference_depth_m(std::span<const Silhouette> silhouettes, const View& view,
                                        int u_px, int v_px, const HullRule& rule = {});

}  // namespace fivepipe::hull
