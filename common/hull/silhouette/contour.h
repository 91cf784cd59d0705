// The tangent of a silhouette's border: a binary map's is a staircase, so it comes from a fit over
// a window of it.
#pragma once
#include <Eigen/Core>

#include "common/hull/cpu/skip_map.h"

namespace fivepipe::hull {

// What lies on the kept side of a contour: object pixels; or, where leaving an image's border lets
// a point stay, what is not empty.
enum class Kept { object, not_empty };

// A map's pixels with the image they lie in.
struct ContourMap {
  const SkipMap* skip_map;  // with Quadrant::right_down
  PixelRect image;
  Kept kept;
  bool keeps(int u_px, int v_px) const {
    if (skip_map->at(Quadrant::right_down, u_px, v_px) < 0) return true;
    return kept == Kept::not_empty && intersection(image, {u_px, v_px, u_px + 1, v_px + 1}).empty();
  }
};

// Unit normal, in the image, of the contour at uv_px, away from what is kept. The contour runs
// between the pixel (u, v), which is kept, and its neighbour (u + du, v + dv), which is not, du or
// dv being 0, the other -1 or 1; uv_px lies on that edge.
//
// A parabola is fitted, by least squares, to the middles of the pixel edges along the contour, at
// most kContourEdges to each side, fewer where the contour turns by more than kMaxTurn_rad between
// the sides. Measured on discs (tests/hull_surface.cpp): radius 20 px 0.30 degrees median, 1.0 p95;
// radius 3 px 2.5 and 7.2.
inline constexpr int kContourEdges = 16, kFewestContourEdges = 2;
inline constexpr double kMaxTurn_rad = 1.4;
struct ContourFit {
  Eigen::Vector2d normal;
  // Standard error of the fit, taken from its residuals; where too few edges are left for it, a
  // pixel's over half the chord; half the turn where the contour turns by more than kMaxTurn_rad
  // even in the smallest window.
  double error_rad;
};
ContourFit contour_fit(const ContourMap& map, int u_px, int v_px, int du_px, int dv_px,
                       const Eigen::Vector2d& uv_px);
inline Eigen::Vector2d contour_normal(const ContourMap& map, int u_px, int v_px, int du_px,
                                      int dv_px, const Eigen::Vector2d& uv_px) {
  return contour_fit(map, u_px, v_px, du_px, dv_px, uv_px).normal;
}

}  // namespace fivepipe::hull
