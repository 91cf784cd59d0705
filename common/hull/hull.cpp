#include "common/hull/hull.h"

namespace fivepipe::hull {

bool in_hull(std::span<const Silhouette> silhouettes, const Eigen::Vector3d& p_world_m,
             const HullRule& rule) {
  if (!p_world_m.allFinite() || !rule.within_world_m.contains(p_world_m)) return false;
  int seen = 0;
  for (const Silhouette& s : silhouettes) {
    const auto uv_px = geometry::project(s.camera, p_world_m);
    const bool sees = uv_px && s.pixels.holds(uv_px->x(), uv_px->y());
    if (!sees && rule.limits == Limits::seen) continue;
    if (!sees || !s.pixels.contains_at(uv_px->x(), uv_px->y())) return false;
    ++seen;
  }
  return seen >= (rule.limits == Limits::seen ? rule.min_seen : 1);
}

}  // namespace fivepipe::hull
