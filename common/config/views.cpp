#include "common/config/views.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace fivepipe::config {
namespace {

// If the z component of a view's unit direction is larger, the world's y axis is up in its image: z
// is almost parallel to the view.
constexpr double kVertical = 0.999;

}  // namespace

geometry::Pinhole shadow_map_pinhole(const ShadowView& shadows) {
  return geometry::pinhole_from_fov(shadows.map_px, shadows.map_px, shadows.fov_rad);
}

std::vector<HullView> hull_views(const Scene& scene, const Viewer& viewer) {
  std::vector<HullView> views;
  if (std::optional<HullView> light = light_view(scene)) views.push_back(*std::move(light));
  std::ranges::move(eye_views(viewer), std::back_inserter(views));
  return views;
}

std::vector<HullView> hull_views(const Deployment& deployment) {
  return hull_views(deployment.scene, deployment.viewer);
}

std::vector<HullView> eye_views(const Viewer& viewer) {
  std::vector<HullView> views;
  const std::vector<double> eyes_m = eye_positions_m(viewer);
  for (std::size_t eye = 0; eye < eyes_m.size(); ++eye)
    views.push_back({viewer.name + (eyes_m.size() > 1 ? kEyeSuffixes[eye] : ""),
                     recon_pinhole(viewer), viewer.near_m, viewer.far_m, std::nullopt,
                     eyes_m[eye]});
  return views;
}

Eigen::Isometry3d eye_from_world(const HullView& view, const Eigen::Isometry3d& head_from_world) {
  return view.fixed ? *view.fixed : eye_at(view.eye_x_m, head_from_world);
}

bool is_view_of(const Viewer& viewer, const std::string& name) {
  return name == viewer.name ||
         std::any_of(std::begin(kEyeSuffixes), std::end(kEyeSuffixes),
                     [&](const char* suffix) { return name == viewer.name + suffix; });
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
