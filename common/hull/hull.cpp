#include "common/hull/hull.h"

namespace fivepipe {

bool in_hull(std::span<const Silhouette> silhouettes, const Eigen::Vector3d& p_world_m) {
  for (const Silhouette& s : silhouettes) {
    const auto uv_px = project(s.camera, p_world_m);
    if (!uv_px || !s.pixels.contains_at(uv_px->x(), uv_px->y())) return false;
  }
  return !silhouettes.empty();
}

}  // namespace fivepipe
