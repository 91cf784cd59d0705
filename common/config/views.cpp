#include "common/config/views.h"

#include <cmath>

namespace fivepipe::config {
namespace {

// A view along this axis would have no upward direction.
constexpr double kVertical = 0.999;

}  // namespace

geometry::Pinhole shadow_map_pinhole(const ShadowView& shadows) {
  return geometry::pinhole_from_fov(shadows.map_px, shadows.map_px, shadows.fov_rad);
}

std::optional<HullView> light_view(const Scene& scene) {
  if (!scene.shadows) return std::nullopt;
  const ShadowView& shadows = *scene.shadows;
  const Eigen::Vector3d direction = (shadows.target_world_m - scene.light_world_m).normalized(),
                        up = std::abs(direction.z()) < kVertical ? Eigen::Vector3d::UnitZ()
                                                                 : Eigen::Vector3d::UnitY();
  return HullView{kLightView,
                  geometry::resized(shadow_map_pinhole(shadows), shadows.hull_size_px[0],
                                    shadows.hull_size_px[1]),
                  shadows.near_m, shadows.far_m,
                  geometry::look_at(scene.light_world_m, shadows.target_world_m, up)};
}

}  // namespace fivepipe::config
