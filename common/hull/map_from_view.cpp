#include "common/hull/map_from_view.h"

#include <algorithm>
#include <cmath>

namespace fivepipe::hull {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

// Maps (u, v, 1) to the direction of the ray in the camera frame, with z = 1.
Matrix3d sight_from_pixel(const geometry::Pinhole& k) {
  Matrix3d sight;
  sight << 1 / k.fx_px, 0, -k.cx_px / k.fx_px, 0, 1 / k.fy_px, -k.cy_px / k.fy_px, 0, 0, 1;
  return sight;
}

}  // namespace

MapFromView map_from_view(const geometry::Camera& map_camera, const geometry::Camera& view) {
  const Matrix3d pixel_from_camera = geometry::pixel_from_camera(map_camera.pinhole);
  const Matrix3d pixel_from_world = pixel_from_camera * map_camera.camera_from_world.linear();
  return {
      pixel_from_camera * (map_camera.camera_from_world * geometry::camera_center_world_m(view)),
      pixel_from_world * view.camera_from_world.linear().transpose() *
          sight_from_pixel(view.pinhole)};
}

void add_half_spaces(const MapFromView& map, const PixelRect& bounds,
                     std::vector<HalfSpace>& half_spaces) {
  const auto add = [&](const Vector3d& of_pixel, double constant) {
    half_spaces.push_back(
        {of_pixel.dot(map.at_eye) + constant, map.at_infinity.transpose() * of_pixel});
  };
  add({0, 0, 1}, -kNearestToCamera_m);
  add({1, 0, -double(bounds.u0_px)}, 0);
  add({-1, 0, double(bounds.u1_px)}, 0);
  add({0, 1, -double(bounds.v0_px)}, 0);
  add({0, -1, double(bounds.v1_px)}, 0);
}

ViewRays view_rays(const geometry::Camera& view) {
  return {geometry::camera_center_world_m(view),
          view.camera_from_world.linear().transpose() * sight_from_pixel(view.pinhole)};
}

void add_half_spaces(const ViewRays& rays, const Eigen::AlignedBox3d& box_world_m,
                     std::vector<HalfSpace>& half_spaces) {
  for (int axis = 0; axis < 3; ++axis) {
    const double low_m = box_world_m.min()[axis], high_m = box_world_m.max()[axis];
    const Vector3d direction = rays.direction_of_pixel.row(axis);
    if (std::isfinite(low_m)) half_spaces.push_back({rays.eye_world_m[axis] - low_m, direction});
    if (std::isfinite(high_m)) half_spaces.push_back({high_m - rays.eye_world_m[axis], -direction});
  }
}

PixelRect pixels_at_depth(const std::vector<HalfSpace>& half_spaces, double t,
                          const PixelRect& view) {
  std::vector<Vector2d> polygon{{view.u0_px - 0.5, view.v0_px - 0.5},
                                {view.u1_px - 0.5, view.v0_px - 0.5},
                                {view.u1_px - 0.5, view.v1_px - 0.5},
                                {view.u0_px - 0.5, view.v1_px - 0.5}};
  std::vector<Vector2d> kept;
  for (const HalfSpace& h : half_spaces) {  // Sutherland and Hodgman, 1974
    kept.clear();
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
      const double side_a = h.offset + t * h.slope_at(a.x(), a.y()),
                   side_b = h.offset + t * h.slope_at(b.x(), b.y());
      if (side_a >= 0) kept.push_back(a);
      if ((side_a >= 0) != (side_b >= 0)) kept.push_back(a + side_a / (side_a - side_b) * (b - a));
    }
    if (kept.empty()) return {};
    polygon.swap(kept);
  }
  Eigen::AlignedBox2d box;
  for (const Vector2d& p : polygon) box.extend(p);
  const auto pixel = [](double x) { return int(std::lround(x)); };
  return intersection(view, {pixel(box.min().x()) - 1, pixel(box.min().y()) - 1,
                             pixel(box.max().x()) + 2, pixel(box.max().y()) + 2});
}

bool is_finite(const geometry::Camera& camera) {
  const geometry::Pinhole& k = camera.pinhole;
  return std::isfinite(k.fx_px) && std::isfinite(k.fy_px) && std::isfinite(k.cx_px) &&
         std::isfinite(k.cy_px) && k.fx_px > 0 && k.fy_px > 0 &&
         camera.camera_from_world.matrix().allFinite();
}

}  // namespace fivepipe::hull
