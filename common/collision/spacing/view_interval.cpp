#include "common/collision/spacing/view_interval.h"

#include <algorithm>

namespace fivepipe::collision {
namespace {

// Keeps the spacings s of the interval with at_0 + s * slope >= 0.
void keep(SpacingInterval& interval, double at_0, double slope) {
  if (slope > 0)
    interval.low_m = std::max(interval.low_m, -at_0 / slope);
  else if (slope < 0)
    interval.high_m = std::min(interval.high_m, -at_0 / slope);
  else if (!(at_0 >= 0))
    interval = {1, 0};
}

}  // namespace

std::optional<SpacingInterval> interval_in_view(const MovablePart& part,
                                                const SpacingInterval& range,
                                                std::span<const geometry::Camera> cameras,
                                                const Eigen::AlignedBox3d& within_world_m) {
  SpacingInterval interval = range;
  const Eigen::Vector3d& axis = part.axis_world();
  std::vector<Eigen::Vector3d> vertices_m = part.tree().mesh().vertices_m;  // at spacing 0
  for (Eigen::Vector3d& vertex_m : vertices_m) vertex_m += part.move_world_m(0);
  for (const Eigen::Vector3d& vertex_m : vertices_m)
    for (int i = 0; i < 3; ++i) {
      keep(interval, vertex_m[i] - within_world_m.min()[i], axis[i]);
      keep(interval, within_world_m.max()[i] - vertex_m[i], -axis[i]);
    }
  for (const geometry::Camera& camera : cameras) {
    const geometry::Pinhole& k = camera.pinhole;
    // In front of the camera, and between the borders of the image: z times the pixel's distance to
    // each of them.
    Eigen::Matrix<double, 5, 3> borders;
    borders << 0, 0, 1,                           //
        k.fx_px, 0, k.cx_px + 0.5,                //
        -k.fx_px, 0, k.width_px - 0.5 - k.cx_px,  //
        0, k.fy_px, k.cy_px + 0.5,                //
        0, -k.fy_px, k.height_px - 0.5 - k.cy_px;
    const Eigen::Matrix<double, 5, 1> slopes = borders * (camera.camera_from_world.linear() * axis);
    for (const Eigen::Vector3d& vertex_m : vertices_m) {
      const Eigen::Matrix<double, 5, 1> at_0 = borders * (camera.camera_from_world * vertex_m);
      for (int i = 0; i < 5; ++i) keep(interval, at_0[i], slopes[i]);
    }
  }
  if (!(interval.low_m <= interval.high_m)) return std::nullopt;
  return interval;
}

}  // namespace fivepipe::collision
