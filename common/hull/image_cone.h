// Distances from a point to the pyramid that a rectangle of pixels covers in space. Its apex is the
// camera's centre.
//
//        \  rect  /     p, inside:  the exact distance to the nearest of the four faces
//         \  .p  /      q, outside: the distance to the farthest plane that separates q from the
//     q .  \    /                   pyramid, which is a lower bound of the distance to the pyramid
//           \  /
//            \/ centre
//
// The bound for q is the exact distance if the point of the pyramid nearest to q is inside a face.
#pragma once
#include <Eigen/Core>

#include "common/geometry/camera.h"
#include "common/hull/object_pixels.h"

namespace fivepipe::hull {

// Returns the pixels of the camera's image.
inline PixelRect image_of(const geometry::Camera& camera) {
  return {0, 0, camera.pinhole.width_px, camera.pinhole.height_px};
}
// Returns true if uv is in the half-open squares of the pixels, as ObjectPixels::holds() does.
inline bool holds(const PixelRect& rect, double u_px, double v_px) {
  return u_px >= rect.u0_px - 0.5 && v_px >= rect.v0_px - 0.5 && u_px < rect.u1_px - 0.5 &&
         v_px < rect.v1_px - 0.5;
}

// A point in a camera's frame and its pixel. rounding_m bounds how far rounding may have moved the
// point, here or in in_hull() [m].
struct ProjectedPoint {
  Eigen::Vector3d p_camera_m;
  double rounding_m;
  double u_px, v_px;  // valid if Z > 0
};

// The open pyramid of a non-empty rectangle of pixels. Each face's unit normal points inward:
// (x, 0, z) for left and right, (0, y, z) for up and down.
struct Pyramid {
  Eigen::Vector2d left_xz, right_xz, up_yz, down_yz;
};

class ImageCone {
 public:
  explicit ImageCone(const geometry::Camera& camera);  // is_finite(camera)

  // Returns the point in the camera frame, its pixel and its rounding.
  ProjectedPoint see(const Eigen::Vector3d& p_world_m) const;
  // Returns the pyramid of a rectangle of pixels, which is not empty.
  Pyramid pyramid(const PixelRect& rect) const;
  // Return lower bounds of the distance to the pyramid's border [m, world]: inside_m for a point
  // inside, outside_m for a point outside. <= 0 if the point is on the other side, or too near to
  // the border to decide within rounding.
  double inside_m(const ProjectedPoint& p, const Pyramid& pyramid) const;
  double outside_m(const ProjectedPoint& p, const Pyramid& pyramid) const;

 private:
  geometry::Camera camera_;
  // 1 / the largest singular value of the rotation, which may not be exactly orthonormal.
  double world_per_camera_;
  double rounding_;       // as a fraction of the point's and the camera's distances from the origin
  double translation_m_;  // sum of the absolute values of the translation's components
};

}  // namespace fivepipe::hull
