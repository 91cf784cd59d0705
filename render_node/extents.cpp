#include "render_node/extents.h"

#include <algorithm>

namespace fivepipe::render {

double near_corner_m(const geometry::Pinhole& pinhole, double near_m) {
  double farthest_m = 0;
  for (const double u_px : {-0.5, pinhole.width_px - 0.5})
    for (const double v_px : {-0.5, pinhole.height_px - 0.5})
      farthest_m =
          std::max(farthest_m, near_m * Eigen::Vector3d((u_px - pinhole.cx_px) / pinhole.fx_px,
                                                        (v_px - pinhole.cy_px) / pinhole.fy_px, 1)
                                            .norm());
  return farthest_m;
}

double light_reach_m(const config::Scene& scene) {
  Eigen::AlignedBox3d box;
  for (const config::SceneObject& object : scene.objects) {
    const Eigen::AlignedBox3d local = bounds_m(config::mesh_of(object));
    if (!local.isEmpty()) box.extend(local.transformed(object.world_from_object));
  }
  // A light at the center of the scene must still light it.
  constexpr double kMinLightDistance_m = 0.1;
  return std::max(
      kMinLightDistance_m,
      ((box.isEmpty() ? Eigen::Vector3d::Zero().eval() : box.center()) - scene.light_world_m)
          .norm());
}

}  // namespace fivepipe::render
