// The normal of a silhouette's contour. The contour of a binary map is a staircase, so the normal
// is fitted over a window of pixel edges.
#pragma once
#include <Eigen/Core>

#include "common/hull/cpu/skip_map.h"

namespace fivepipe::hull {

// The kept side of a contour: object pixels, or (not_empty) object pixels and everything outside
// the image. The latter applies with Limits::seen, because a point may then leave an image and stay
// in the hull.
enum class Kept { object, not_empty };

// The pixels of a map and the image that holds them.
struct ContourMap {
  const SkipMap* skip_map;  // has Quadrant::right_down
  PixelRect image;
  Kept kept;
  bool keeps(int u_px, int v_px) const {
    if (skip_map->at(Quadrant::right_down, u_px, v_px) < 0) return true;
    return kept == Kept::not_empty && intersection(image, {u_px, v_px, u_px + 1, v_px + 1}).empty();
  }
};

// The edge between a kept pixel and its neighbour pixel + outward, which is not kept. One
// coordinate of outward is 0, the other -1 or 1.
struct ContourEdge {
  Eigen::Vector2i pixel, outward;
  bool operator==(const ContourEdge&) const = default;
  Eigen::Vector2d center_px() const { return pixel.cast<double>() + 0.5 * outward.cast<double>(); }
};

// Fits the contour's unit normal in the image at uv_px, away from the kept side. uv_px is on
// `edge`.
//
// The fit is a least-squares parabola through the centers of the pixel edges along the contour: at
// most kContourEdges to each side, fewer if the contour turns by more than kMaxTurn_rad between the
// sides. Errors on discs (tests/hull/silhouette/surface_test.cpp): 0.30 degrees median and 1.0
// degrees p95 for a radius of 20 px, 2.5 and 7.2 degrees for 3 px.
inline constexpr int kContourEdges = 16, kMinContourEdges = 2;
inline constexpr double kMaxTurn_rad = 1.4;
struct ContourFit {
  Eigen::Vector2d normal;
  // Standard error of the fit, from its residuals. With too few edges for a fit it is one pixel
  // over half the chord; if the contour turns by more than kMaxTurn_rad even in the smallest
  // window, at least half the turn.
  double error_rad;
  // The fitted contour's point nearest to uv_px, within the error of the fit: the staircase's mean.
  Eigen::Vector2d on_contour_px;
};
ContourFit contour_fit(const ContourMap& map, const ContourEdge& edge,
                       const Eigen::Vector2d& uv_px);

}  // namespace fivepipe::hull
