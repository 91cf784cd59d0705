// Scenes that attack the certified margins: maps of real sizes, and rays whose images pass borders
// of object pixels at a distance that float cannot resolve and double can.
#pragma once
#include <algorithm>
#include <cmath>

#include "tests/support/hull/scenes.h"

namespace fivepipe::test {

// The images pass a border at 1e-8 px to 0.3 px. Double is exact to 1e-10 px. Float is exact to
// 1e-4 px if the ray parameter is known. It is that of another camera's border, which float knows
// to some 0.1 mm only if that camera's image moves slowly.
inline constexpr double kNearest_px = 1e-8, kFarthest_px = 0.3;

inline double log_uniform(Random& random, double low, double high) {
  return low * std::pow(high / low, uniform(random, 0, 1));
}
inline double tiny_offset_px(Random& random) {
  const double side = random() % 2 ? 1 : -1;
  return side * log_uniform(random, kNearest_px, kFarthest_px);
}

// Rectangles of object pixels, many of them a single pixel or a line, in a part of the image.
inline hull::ObjectPixels sparse_pixels(Random& random, int width_px, int height_px) {
  hull::ObjectPixels pixels(width_px, height_px);
  const double part = log_uniform(random, 0.1, 1);
  const int u0 = int(uniform(random, 0, (1 - part) * width_px)),
            v0 = int(uniform(random, 0, (1 - part) * height_px));
  for (int i = 0; i < 24; ++i) {
    const int u = u0 + int(uniform(random, 0, part * width_px)),
              v = v0 + int(uniform(random, 0, part * height_px));
    const int end_u = std::min(width_px, u + int(log_uniform(random, 1, 0.3 * part * width_px))),
              end_v = std::min(height_px, v + int(log_uniform(random, 1, 0.3 * part * height_px)));
    for (int y = v; y < end_v; ++y) pixels.set_run(u, end_u, y);
  }
  return pixels;
}

// Returns a corner between pixels, of which at least one and not all are object pixels.
inline Eigen::Vector2d any_corner(Random& random, const hull::ObjectPixels& pixels) {
  const hull::PixelRect b = pixels.bounds();
  for (;;) {
    const int v = int(uniform(random, b.v0_px - 1, b.v1_px + 1)),
              begin = pixels.find(int(uniform(random, b.u0_px, b.u1_px)), b.u1_px,
                                  std::clamp(v, b.v0_px, b.v1_px - 1), true);
    const int u = random() % 2
                      ? begin
                      : pixels.find(begin, b.u1_px, std::clamp(v, b.v0_px, b.v1_px - 1), false);
    int object = 0;
    for (const int dv : {-1, 0})
      for (const int du : {-1, 0}) object += pixels.contains(u + du, v + dv);
    if (object > 0 && object < 4) return {u - 0.5, v - 0.5};
  }
}

// A camera that sees a place, near or far away, with a short or a long focal length.
inline hull::Silhouette random_silhouette(Random& random, const Eigen::Vector3d& place_m,
                                          int width_px, int height_px) {
  const double distance_m = random() % 8 ? log_uniform(random, 0.1, 2.5) : 100,
               fov_rad = random() % 2 ? uniform(random, 0.3, 1.2) : log_uniform(random, 0.001, 1);
  return {{geometry::pinhole_from_fov(width_px, height_px, fov_rad),
           random_look_at(random, place_m + distance_m * random_direction(random), place_m, 0.05)},
          sparse_pixels(random, width_px, height_px)};
}

// A place near the world's origin or 1 km away.
inline Eigen::Vector3d random_place_m(Random& random) {
  return random() % 4 ? Eigen::Vector3d(0, 0, 0) : 1000 * random_direction(random);
}

// A view of the place; sometimes with the axes of a camera, so that images move along rows or
// columns of its map, or from beside the camera, so that images move slowly.
inline hull::View random_view(Random& random, const Eigen::Vector3d& place_m,
                              const geometry::Camera& camera) {
  const bool beside = random() % 3 == 0, same_axes = random() % 5 == 0;
  const double distance_m = beside ? log_uniform(random, 1e-4, 0.1) : uniform(random, 0.3, 3);
  const Eigen::Vector3d eye_m = (beside ? geometry::camera_center_world_m(camera) : place_m) +
                                distance_m * random_direction(random);
  hull::View view{{geometry::pinhole_from_fov(640, 480, log_uniform(random, 0.05, 1.2)),
                   random_look_at(random, eye_m, place_m, 0.1)},
                  0.05,
                  10.0};
  if (same_axes) {
    view.camera.camera_from_world = camera.camera_from_world;
    view.camera.camera_from_world.translation() += Eigen::Vector3d{
        uniform(random, -0.3, 0.3), random() % 2 ? 0 : uniform(random, -0.3, 0.3), 0};
  }
  return view;
}

// Shifts a camera's principal point so that the point's image is at uv.
inline void shift_image(geometry::Camera& camera, const Eigen::Vector3d& p_world_m,
                        const Eigen::Vector2d& uv_px) {
  const Eigen::Vector2d shift_px = uv_px - *geometry::project(camera, p_world_m);
  camera.pinhole.cx_px += shift_px.x();
  camera.pinhole.cy_px += shift_px.y();
}

}  // namespace fivepipe::test
