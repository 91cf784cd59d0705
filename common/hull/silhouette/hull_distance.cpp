#include "common/hull/silhouette/hull_distance.h"

#include "common/hull/silhouette/border_plane.h"

namespace fivepipe::hull {
namespace {

// The gradient has length 1 at a single border. It is shorter between borders on opposite sides.
constexpr double kMinGradient = 0.25;

// As limiting_borders() expects it.
int min_seen(const HullRule& rule) { return rule.limits == Limits::seen ? rule.min_seen : 0; }

}  // namespace

HullDistance::HullDistance(std::span<const Silhouette> silhouettes, const HullRule& rule)
    : rule_(rule) {
  cameras_.reserve(silhouettes.size());
  for (const Silhouette& silhouette : silhouettes) {
    const geometry::Camera& camera = silhouette.camera;
    const DistanceCamera& c = cameras_.emplace_back(DistanceCamera{
        camera, geometry::camera_center_world_m(camera), BorderDistance(silhouette.pixels)});
    DistanceSimdCamera& simd = simd_cameras_.emplace_back();
    Eigen::Map<Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(simd.pixel_from_world) =
        geometry::centered_pixel_from_camera(camera.pinhole) *
        camera.camera_from_world.matrix().topRows<3>();
    simd.per_focal_px = 2 / (camera.pinhole.fx_px + camera.pinhole.fy_px);
    simd.image_width_px = camera.pinhole.width_px;
    simd.image_height_px = camera.pinhole.height_px;
    simd.distance = c.distance.region();
  }
}

std::optional<SurfaceNearby> HullDistance::near(const Eigen::Vector3d& p_world_m,
                                                double reach_m) const {
  LimitingBorder border;
  limiting_borders(simd_cameras_, min_seen(rule_), {&p_world_m, 1}, reach_m, &border);
  return surface_at(border, p_world_m);
}

void HullDistance::near(std::span<const Eigen::Vector3d> p_world_m, double reach_m,
                        std::span<std::optional<SurfaceNearby>> surfaces) const {
  std::vector<LimitingBorder> borders(p_world_m.size());
  limiting_borders(simd_cameras_, min_seen(rule_), p_world_m, reach_m, borders.data());
  for (std::size_t i = 0; i < borders.size(); ++i)
    surfaces[i] = surface_at(borders[i], p_world_m[i]);
}

std::optional<SurfaceNearby> HullDistance::surface_at(const LimitingBorder& border,
                                                      const Eigen::Vector3d& p_world_m) const {
  if (border.camera < 0 || !rule_.within_world_m.contains(p_world_m)) return std::nullopt;
  const DistanceCamera& c = cameras_[std::size_t(border.camera)];
  const std::optional<Eigen::Vector2d> uv_px = geometry::project(c.camera, p_world_m);
  if (!uv_px) return std::nullopt;  // at the camera's centre, where the depths differ by rounding
  const Eigen::Vector2d gradient = c.distance.gradient(*uv_px);
  const double length = gradient.norm();
  if (!(length > kMinGradient)) return std::nullopt;
  const Eigen::Vector2d outward = -gradient / length;
  const Eigen::Vector3d normal =
      plane_normal(c.camera, *uv_px + border.distance_px * outward, outward);
  return SurfaceNearby{normal.dot(p_world_m - c.center_world_m), normal};
}

}  // namespace fivepipe::hull
