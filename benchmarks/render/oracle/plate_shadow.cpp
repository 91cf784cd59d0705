#include "benchmarks/render/oracle/plate_shadow.h"

#include <algorithm>
#include <cmath>

#include "benchmarks/render/oracle/hull_pixel.h"
#include "common/config/views.h"

namespace fivepipe::render::plate_shadow {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// A thin plate whose front is at y = center_m.y().
config::SceneObject plate(const std::string& name, const Vector3d& center_m, double edge_m) {
  constexpr double kThickness_m = 1e-3;
  config::SceneObject object;
  object.name = name;
  object.shape = config::BoxShape{{edge_m, kThickness_m, edge_m}};
  object.world_from_object.translation() = center_m + Vector3d(0, kThickness_m / 2, 0);
  return object;
}

int brightness(const cv::Vec3b& bgr) { return bgr[0] + bgr[1] + bgr[2]; }

// Signed distance [px] of a point from the edge of the shadow in the image; negative inside.
double distance_px(const geometry::Pinhole& image, const Vector2d& uv_px) {
  const double grown = (kWall_m - kLight_m.y()) / (kOccluder_m - kLight_m.y()),
               px_per_m = image.fx_px / kWall_m, half_px = grown * kHalf_m * px_per_m;
  const Vector3d center_m = kLight_m + grown * (kOccluderCenter_m - kLight_m);
  const Vector2d center_px(image.cx_px + center_m.x() * px_per_m,
                           image.cy_px - center_m.z() * px_per_m);
  const Vector2d beyond = (uv_px - center_px).cwiseAbs() - Vector2d::Constant(half_px);
  return beyond.cwiseMax(0.0).norm() + std::min(beyond.maxCoeff(), 0.0);
}

}  // namespace

config::ShadowView shadow_view() {
  config::ShadowView shadows;
  shadows.target_world_m = {0.15, 1.5, 0};
  shadows.fov_rad = 1.6;
  return shadows;
}

config::Scene scene(bool with_shadows, bool with_occluder) {
  config::Scene scene;
  scene.objects.push_back(plate("wall", {0, kWall_m, 0}, 8));
  if (with_occluder) scene.objects.push_back(plate("occluder", kOccluderCenter_m, 2 * kHalf_m));
  scene.light_world_m = kLight_m;
  if (with_shadows) scene.shadows = shadow_view();
  return scene;
}

Eigen::Isometry3d eye_from_world() {
  return geometry::look_at(Vector3d::Zero(), Vector3d::UnitY());
}

HullFrame occluder_in_light(const Vector3d& moved_m) {
  const config::HullView view = *config::light_view(scene(true));
  const geometry::Camera light{view.recon, *view.fixed};
  const Vector3d center_m = kOccluderCenter_m + moved_m;
  std::vector<float> depth_m;
  for (int v = 0; v < view.recon.height_px; ++v)
    for (int u = 0; u < view.recon.width_px; ++u) {
      const geometry::Ray ray = geometry::ray_through(light, Vector2d(u, v));
      const double t = (center_m.y() - ray.origin_world_m.y()) / ray.direction_world.y();
      const Vector3d p_m = ray.origin_world_m + t * ray.direction_world - center_m;
      const bool hit = t > 0 && std::abs(p_m.x()) < kHalf_m && std::abs(p_m.z()) < kHalf_m;
      depth_m.push_back(hit ? float(t) : hull::kNoHull);
    }
  return frame_of_depths(light, std::move(depth_m));
}

Vector3d on_wall_m(const geometry::Pinhole& image, double u_px, double v_px) {
  return {(u_px - image.cx_px) / image.fx_px * kWall_m, kWall_m,
          -(v_px - image.cy_px) / image.fy_px * kWall_m};
}

bool is_shadowed(const Vector3d& p_m) {
  const double at = (kOccluder_m - kLight_m.y()) / (p_m.y() - kLight_m.y());
  const Vector3d crossing = kLight_m + at * (p_m - kLight_m) - kOccluderCenter_m;
  return std::abs(crossing.x()) < kHalf_m && std::abs(crossing.z()) < kHalf_m;
}

bool shows_occluder(const geometry::Pinhole& image, int u_px, int v_px) {
  constexpr double kMargin_m = 0.003;
  const Vector3d p_m = kOccluder_m / kWall_m * on_wall_m(image, u_px, v_px) - kOccluderCenter_m;
  return std::abs(p_m.x()) < kHalf_m + kMargin_m && std::abs(p_m.z()) < kHalf_m + kMargin_m;
}

bool is_dark(const cv::Mat& lit_bgr, const cv::Mat& drawn_bgr, int u_px, int v_px) {
  return 3 * brightness(drawn_bgr.at<cv::Vec3b>(v_px, u_px)) <
         2 * brightness(lit_bgr.at<cv::Vec3b>(v_px, u_px));
}

EdgeError edge_error(const cv::Mat& lit_bgr, const cv::Mat& drawn_bgr,
                     const geometry::Pinhole& image, bool has_occluder) {
  EdgeError error{0, 0, 0};
  int wrong_px = 0;
  for (int v = 0; v < drawn_bgr.rows; ++v)
    for (int u = 0; u < drawn_bgr.cols; ++u) {
      if (has_occluder && shows_occluder(image, u, v)) continue;
      const bool expected = is_shadowed(on_wall_m(image, u, v));
      error.shadowed_px += expected;
      if (is_dark(lit_bgr, drawn_bgr, u, v) == expected) continue;
      ++wrong_px;
      error.worst_px = std::max(error.worst_px, std::abs(distance_px(image, Vector2d(u, v))));
    }
  error.mean_px = wrong_px / (4 * std::sqrt(error.shadowed_px));  // the shadow is a square
  return error;
}

double map_pixel_px(const geometry::Pinhole& image) {
  return (kWall_m - kLight_m.y()) / config::shadow_map_pinhole(shadow_view()).fx_px * image.fx_px /
         kWall_m;
}

}  // namespace fivepipe::render::plate_shadow
