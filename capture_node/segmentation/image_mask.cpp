#include "capture_node/segmentation/image_mask.h"

#include <algorithm>
#include <cassert>
#include <limits>

#include "capture_node/segmentation/bit_morphology.h"
#include "common/geometry/lens.h"

namespace fivepipe::capture {
namespace {

// Slab test (Kay and Kajiya 1986): true if the ray, from its origin on, meets the box.
bool meets(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
           const Eigen::AlignedBox3d& box) {
  double enter = 0, leave = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0) {
      if (origin[axis] < box.min()[axis] || origin[axis] > box.max()[axis]) return false;
      continue;
    }
    double a = (box.min()[axis] - origin[axis]) / direction[axis],
           b = (box.max()[axis] - origin[axis]) / direction[axis];
    if (a > b) std::swap(a, b);
    enter = std::max(enter, a);
    leave = std::min(leave, b);
  }
  return enter <= leave;
}

}  // namespace

hull::ObjectPixels pixels_of_volume(const config::RigCamera& camera,
                                    const Eigen::AlignedBox3d& volume_m) {
  assert(camera.mount == config::Mount::world);
  const geometry::Pinhole& captured = camera.source;
  const double radius = geometry::monotonic_radius(camera.distortion);
  const Eigen::Isometry3d world_from_camera = camera.camera_from_mount.inverse();
  hull::ObjectPixels pixels(captured.width_px, captured.height_px);
  for (int v = 0; v < captured.height_px; ++v)
    for (int u = 0; u < captured.width_px; ++u) {
      const Eigen::Vector2d xy = geometry::undistorted(captured, camera.distortion, {u, v});
      if (!(xy.norm() < radius)) continue;  // also not converged
      const Eigen::Vector3d direction =
          world_from_camera.linear() * Eigen::Vector3d(xy.x(), xy.y(), 1);
      if (meets(world_from_camera.translation(), direction, volume_m)) pixels.set(u, v);
    }
  return dilated(std::move(pixels), kVolumeMargin_px);
}

}  // namespace fivepipe::capture
