// A map's camera as a view sees it: where the rays of a view run in the map, and which part of them
// can meet object pixels.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "common/geometry/camera.h"
#include "common/hull/object_pixels.h"

namespace fivepipe::hull {

// Rays start this far in front of a map's camera [m], so that its pixel is determined there: at
// 1e-9 m rounding (1e-16 m) moves it by 1e-4 px; a hull point nearer to a camera's centre than that
// is no scene's business.
inline constexpr double kNearestToCamera_m = 1e-9;

// The homogeneous map pixel (U, V, W) of the point at depth t [m] on the ray through view pixel (u,
// v) is at_eye + t * at_infinity * (u, v, 1). Pixel p covers [p, p + 1) of U / W: half a pixel is
// added. W is the map camera's depth [m].
struct MapFromView {
  Eigen::Vector3d at_eye;
  Eigen::Matrix3d at_infinity;
};
MapFromView map_from_view(const geometry::Camera& map_camera, const geometry::Camera& view);

// The points of a view's rays where offset + t * slope_at(u, v) >= 0.
struct HalfSpace {
  double offset;
  Eigen::Vector3d slope;  // of (u, v, 1)
  double slope_at(double u, double v) const { return slope.x() * u + (slope.y() * v + slope.z()); }
};

// Appends the five that hold every point in front of the map's camera whose pixel lies in `bounds`.
void add_half_spaces(const MapFromView& map, const PixelRect& bounds,
                     std::vector<HalfSpace>& half_spaces);

// Smallest rectangle of pixels in `view` whose rays may lie in all half-spaces at depth t [m]: the
// polygon that they leave of the plane at that depth, a pixel wider for rounding.
PixelRect pixels_at_depth(const std::vector<HalfSpace>& half_spaces, double t,
                          const PixelRect& view);

// Finite, with focal lengths > 0: has a projection to compute with.
bool is_finite(const geometry::Camera& camera);

}  // namespace fivepipe::hull
