// Where the hull can be at all: what the rectangles around the object pixels leave of space. Cheap,
// and never too small.
#pragma once
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "common/geometry/camera.h"
#include "common/hull/object_pixels.h"

namespace fivepipe::hull {

// A rectangle that holds every object pixel of a camera's image; not empty.
struct SilhouetteBounds {
  geometry::Camera camera;
  PixelRect part;
};

// Corners [m, world] of the convex body of all points in box_m that project into each of the parts,
// and are at least nearest_m in front of each of their cameras: it holds the hull, as far as that
// lies there (rule Limits::all). Some corners come more than once. Empty: there is no such point.
// Parts are taken a hundredth of a pixel wider than they are: far more than rounding moves. Finite
// input; box_m not empty.
std::vector<Eigen::Vector3d> corners_around_hull(std::span<const SilhouetteBounds> parts,
                                                 const Eigen::AlignedBox3d& box_m,
                                                 double nearest_m);

}  // namespace fivepipe::hull
