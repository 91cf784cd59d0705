// Distances from a point to what a camera's rectangles of pixels cover in space: pyramids with
// their apex in its centre.
//
//        \  rect  /        inside:  the distance to the nearest of the four faces, exact
//         \  .p  /         outside: the distance to the farthest of the planes that part p from the
//         pyramid, a lower bound
//     q .  \    /
//           \  /           Sharper than the design's bound |s| Z / (f k + |s|), which these planes
//           imply, and no dearer.
//            \/ centre
#pragma once
#include <Eigen/Core>

#include "common/geometry/camera.h"
#include "common/hull/object_pixels.h"

namespace fivepipe::hull {

inline PixelRect image_of(const geometry::Camera& camera) {
  return {0, 0, camera.pinhole.width_px, camera.pinhole.height_px};
}
// As ObjectPixels::holds: the pixels' half-open squares.
inline bool holds(const PixelRect& rect, double u_px, double v_px) {
  return u_px >= rect.u0_px - 0.5 && v_px >= rect.v0_px - 0.5 && u_px < rect.u1_px - 0.5 &&
         v_px < rect.v1_px - 0.5;
}

// A point as a camera has it, and how far rounding may have moved it, or its pixel as in_hull()
// finds it [m].
struct ProjectedPoint {
  Eigen::Vector3d p_camera_m;
  double rounding_m;
  double u_px, v_px;  // where Z > 0
};

// The open pyramid of a rectangle of pixels that is not empty: its faces' unit normals, (x, 0, z)
// of left and right, (0, y, z) of the others.
struct Pyramid {
  Eigen::Vector2d left_xz, right_xz, up_yz, down_yz;  // into the pyramid
};

class ImageCone {
 public:
  explicit ImageCone(const geometry::Camera& camera);  // finite

  ProjectedPoint see(const Eigen::Vector3d& p_world_m) const;
  Pyramid pyramid(const PixelRect& rect) const;
  // Lower bounds [m, world] of how far the point is from leaving, or from entering, the pyramid; <=
  // 0 where it is not inside, or not outside, or too near for rounding to tell.
  double inside_m(const ProjectedPoint& p, const Pyramid& pyramid) const;
  double outside_m(const ProjectedPoint& p, const Pyramid& pyramid) const;

 private:
  geometry::Camera camera_;
  double world_per_camera_;  // a rotation that is not quite one stretches lengths: distances shrink
                             // by its largest singular value
  double rounding_;       // as a fraction of the point's and the camera's distance from the origin
  double translation_m_;  // sum of its parts' sizes
};

}  // namespace fivepipe::hull
