// Projection of a view's rays into a map (the object pixels of one camera), and the part of the
// rays that can meet object pixels.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "common/geometry/camera.h"
#include "common/hull/object_pixels.h"

namespace fivepipe::hull {

// Rays start this far in front of a map's camera [m], so that their pixel is well defined: at
// 1e-9 m, rounding (1e-16 m) moves the pixel by 1e-4 px. Hull points nearer to a camera's centre
// are ignored.
inline constexpr double kNearestToCamera_m = 1e-9;

// The point at depth t [m] on the ray through view pixel (u, v) has the homogeneous map pixel
// (U, V, W) = at_eye + t * at_infinity * (u, v, 1). W is its depth in the map's camera [m]. Pixel p
// covers [p, p + 1) of U / W, because half a pixel is added.
struct MapFromView {
  Eigen::Vector3d at_eye;
  Eigen::Matrix3d at_infinity;
};
// Returns the projection of the view's rays into the map. Both cameras must pass is_finite().
MapFromView map_from_view(const geometry::Camera& map_camera, const geometry::Camera& view);

// The points at depth t on the rays through (u, v) for which offset + t * slope_at(u, v) >= 0.
struct HalfSpace {
  double offset;
  Eigen::Vector3d slope;  // coefficients of (u, v, 1)
  double slope_at(double u, double v) const { return slope.x() * u + (slope.y() * v + slope.z()); }
};

// Appends five half-spaces whose intersection holds every point in front of the map's camera with a
// pixel in `bounds`.
void add_half_spaces(const MapFromView& map, const PixelRect& bounds,
                     std::vector<HalfSpace>& half_spaces);

// The view's rays in the world: the point at depth t [m] on the ray through pixel (u, v) is
// eye_world_m + t * direction_of_pixel * (u, v, 1).
struct ViewRays {
  Eigen::Vector3d eye_world_m;
  Eigen::Matrix3d direction_of_pixel;
};
// Returns the rays of a view that passes is_finite().
ViewRays view_rays(const geometry::Camera& view);
// Appends the half-spaces whose intersection is the box; none for a side at infinity.
void add_half_spaces(const ViewRays& rays, const Eigen::AlignedBox3d& box_world_m,
                     std::vector<HalfSpace>& half_spaces);

// Returns the smallest rectangle of pixels in `view` whose rays may be in all half-spaces at depth
// t [m]. It bounds the intersection of the half-spaces with the plane at that depth, one pixel
// wider because of rounding.
PixelRect pixels_at_depth(const std::vector<HalfSpace>& half_spaces, double t,
                          const PixelRect& view);

// Returns true if all parameters are finite and the focal lengths are > 0.
bool is_finite(const geometry::Camera& camera);

}  // namespace fivepipe::hull
