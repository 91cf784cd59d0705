// A convex body that holds the hull: the intersection of the pyramids of the rectangles around the
// object pixels.
#pragma once
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "common/geometry/camera.h"
#include "common/hull/object_pixels.h"

namespace fivepipe::hull {

// A non-empty rectangle that holds every object pixel of a camera's image.
struct SilhouetteBounds {
  geometry::Camera camera;
  PixelRect part;
};

// Returns the corners [m, world] of the convex body of all points in box_m that project into every
// part and are at least nearest_m in front of every camera. The body holds the part of the hull
// (Limits::all) that satisfies both. Corners may be repeated. Returns no corner if there is no such
// point. Each part is widened by 0.01 px, which is far more than rounding. The input must be finite
// and box_m not empty.
std::vector<Eigen::Vector3d> corners_around_hull(std::span<const SilhouetteBounds> parts,
                                                 const Eigen::AlignedBox3d& box_m,
                                                 double nearest_m);

}  // namespace fivepipe::hull
