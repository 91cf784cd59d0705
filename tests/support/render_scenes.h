// Small scenes and hulls for the tests of the renderer.
#pragma once
#include <algorithm>
#include <cmath>
#include <string>

#include "common/config/deployment.h"
#include "render_node/views/tile_assembler.h"

namespace fivepipe::test {

// Returns the pose of an eye at the origin that looks along world y: camera x is world x, camera z
// is world y.
inline Eigen::Isometry3d eye_along_y() {
  return geometry::look_at(Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitY());
}

inline config::SceneObject object(const std::string& name, const config::Shape& shape,
                                  const Eigen::Vector3d& center_world_m,
                                  const std::array<double, 3>& colour_rgb,
                                  config::Pattern pattern = config::Pattern::plain,
                                  double pattern_size_m = 0.1) {
  config::SceneObject o;
  o.name = name;
  o.shape = shape;
  o.world_from_object.translation() = center_world_m;
  o.colour_rgb = colour_rgb;
  o.pattern = pattern;
  o.pattern_size_m = pattern_size_m;
  return o;
}

inline render::HullFrame no_hull(const Eigen::Isometry3d& eye_from_world,
                                 const geometry::Pinhole& recon) {
  render::HullFrame hull;
  hull.eye_from_world = eye_from_world;
  hull.recon = recon;
  return hull;
}

// Returns a hull with depth depth_at(u, v) [m, or kNoHull] at each pixel of the reconstruction. All
// pixels have the colour *bgr; the hull has no colour if bgr is null.
template <typename DepthAt>
render::HullFrame hull_of(const Eigen::Isometry3d& eye_from_world, const geometry::Pinhole& recon,
                          const std::array<std::uint8_t, 3>* bgr, DepthAt depth_at) {
  render::HullFrame hull = no_hull(eye_from_world, recon);
  hull.covered = {recon.width_px, recon.height_px, 0, 0};
  for (int v = 0; v < recon.height_px; ++v)
    for (int u = 0; u < recon.width_px; ++u) {
      const float z = float(depth_at(u, v));
      hull.depth_m.push_back(z);
      if (bgr) hull.bgr.insert(hull.bgr.end(), bgr->begin(), bgr->end());
      if (z == hull::kNoHull) continue;
      hull.covered = {std::min(hull.covered.u0_px, u), std::min(hull.covered.v0_px, v),
                      std::max(hull.covered.u1_px, u + 1), std::max(hull.covered.v1_px, v + 1)};
    }
  return hull;
}

// Returns the depth of the near side of a ball, or kNoHull if the ray misses it.
inline double ball_depth_m(const geometry::Camera& camera, int u_px, int v_px,
                           const Eigen::Vector3d& center_world_m, double radius_m) {
  const geometry::Ray ray = geometry::ray_through(camera, Eigen::Vector2d(u_px, v_px));
  const Eigen::Vector3d to_center = center_world_m - ray.origin_world_m;
  const double a = ray.direction_world.squaredNorm(), b = ray.direction_world.dot(to_center);
  const double discriminant = b * b - a * (to_center.squaredNorm() - radius_m * radius_m);
  return discriminant < 0 ? hull::kNoHull : (b - std::sqrt(discriminant)) / a;
}

}  // namespace fivepipe::test
