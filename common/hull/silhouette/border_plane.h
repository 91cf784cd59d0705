// The plane that touches the hull at a silhouette's border.
#pragma once
#include <Eigen/Core>

#include "common/geometry/camera.h"

namespace fivepipe::hull {

// Returns the unit normal [world] of the plane through the camera's centre and the border's tangent
// at uv. `outward`: the border's normal in the image. The plane's normal is the gradient, in world
// coordinates, of outward . (pixel of p - uv) times the depth of p.
inline Eigen::Vector3d plane_normal(const geometry::Camera& camera, const Eigen::Vector2d& uv_px,
                                    const Eigen::Vector2d& outward) {
  const geometry::Pinhole& k = camera.pinhole;
  const Eigen::Vector3d of_camera(
      outward.x() * k.fx_px, outward.y() * k.fy_px,
      -(outward.x() * (uv_px.x() - k.cx_px) + outward.y() * (uv_px.y() - k.cy_px)));
  return (camera.camera_from_world.linear().transpose() * of_camera).normalized();
}

}  // namespace fivepipe::hull
