// Seeded random rigs, objects and views for the tests of the hull.
//
// C++ leaves open in which order the arguments of a function, or the operands of + - *, are
// evaluated. So no call has two arguments, and no operator two operands, that draw random numbers:
// draw them in a braced initializer, which is evaluated from left to right, or into named
// variables. Otherwise GCC and Clang generate different scenes.
#pragma once
#include <random>
#include <vector>

#include "common/geometry/oriented_box.h"
#include "common/hull/cpu/cpu_hull.h"
#include "common/hull/oracle/analytic.h"

namespace fivepipe::test {

using Random = std::mt19937_64;

inline double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

inline Eigen::Vector3d random_direction(Random& random) {
  std::normal_distribution<double> normal;
  const double z = normal(random), y = normal(random), x = normal(random);
  return Eigen::Vector3d(x, y, z).normalized();
}

// Returns a vector of random direction whose length is uniform in min_length..max_length.
inline Eigen::Vector3d random_vector(Random& random, double min_length, double max_length) {
  const Eigen::Vector3d direction = random_direction(random);
  return uniform(random, min_length, max_length) * direction;
}

inline Eigen::Vector3d random_in_ball(Random& random, double radius_m) {
  const Eigen::Vector3d direction = random_direction(random);
  return radius_m * std::cbrt(uniform(random, 0, 1)) * direction;
}

// Returns a rotation around a random axis by an angle that is uniform in min_rad..max_rad.
inline Eigen::AngleAxisd random_rotation(Random& random, double min_rad, double max_rad) {
  const Eigen::Vector3d axis = random_direction(random);
  return {uniform(random, min_rad, max_rad), axis};
}

// Returns camera_from_world of a camera at eye_world_m with random roll that looks at a random
// point within radius_m of center_world_m.
inline Eigen::Isometry3d random_look_at(Random& random, const Eigen::Vector3d& eye_world_m,
                                        const Eigen::Vector3d& center_world_m,
                                        double radius_m = 0) {
  const Eigen::Vector3d up_world = random_direction(random);
  return geometry::look_at(eye_world_m, center_world_m + random_in_ball(random, radius_m),
                           up_world);
}

// A camera on any side that looks at a point near the origin.
inline geometry::Camera random_camera(Random& random, int width_px, int height_px,
                                      double distance_m = 1.5) {
  const Eigen::Vector3d eye = random_vector(random, 0.7 * distance_m, 1.3 * distance_m);
  return {geometry::pinhole_from_fov(width_px, height_px, uniform(random, 0.4, 0.9)),
          random_look_at(random, eye, Eigen::Vector3d::Zero(), 0.1)};
}

inline std::vector<hull::Capsule> random_object(Random& random, int capsules,
                                                double extent_m = 0.2) {
  std::vector<hull::Capsule> object;
  for (int i = 0; i < capsules; ++i)
    object.push_back({random_in_ball(random, extent_m), random_in_ball(random, extent_m),
                      uniform(random, 0.005, 0.05)});
  return object;
}

inline std::vector<hull::Silhouette> silhouettes_of(
    const std::vector<hull::Capsule>& object, const std::vector<geometry::Camera>& cameras,
    hull::PixelRule rule = hull::PixelRule::touched) {
  std::vector<hull::Silhouette> silhouettes;
  for (const geometry::Camera& camera : cameras)
    silhouettes.push_back({camera, hull::true_object_pixels(object, camera, rule)});
  return silhouettes;
}

// Cameras and the object that they see, in the order in which a test draws them.
struct RandomScene {
  std::vector<geometry::Camera> cameras;
  std::vector<hull::Capsule> object;
};
inline std::vector<hull::Silhouette> silhouettes_of(
    const RandomScene& scene, hull::PixelRule rule = hull::PixelRule::touched) {
  return silhouettes_of(scene.object, scene.cameras, rule);
}

inline std::vector<hull::Silhouette> silhouettes_of_box(
    const Eigen::AlignedBox3d& box_world_m, const std::vector<geometry::Camera>& cameras) {
  const geometry::OrientedBox box{Eigen::Isometry3d(Eigen::Translation3d(box_world_m.center())),
                                  0.5 * box_world_m.sizes()};
  std::vector<hull::Silhouette> silhouettes;
  for (const geometry::Camera& camera : cameras)
    silhouettes.push_back({camera, hull::true_object_pixels(box, camera)});
  return silhouettes;
}

inline std::vector<geometry::Camera> random_cameras(Random& random, int count, int width_px = 160,
                                                    int height_px = 121) {
  std::vector<geometry::Camera> cameras;
  for (int i = 0; i < count; ++i) cameras.push_back(random_camera(random, width_px, height_px));
  return cameras;
}

// Cameras on any side that see only parts of a ball of 0.3 m around the origin.
inline std::vector<geometry::Camera> narrow_cameras(Random& random, int count, int width_px = 160,
                                                    int height_px = 121) {
  std::vector<geometry::Camera> cameras;
  for (int i = 0; i < count; ++i) {
    const double fov_rad = uniform(random, 0.1, 0.4);
    const Eigen::Vector3d up = random_direction(random), target = random_in_ball(random, 0.2),
                          eye = random_vector(random, 0.8, 1.8);
    cameras.push_back({geometry::pinhole_from_fov(width_px, height_px, fov_rad),
                       geometry::look_at(eye, target, up)});
  }
  return cameras;
}

inline hull::PixelRect whole_image(const geometry::Camera& camera) {
  return {0, 0, camera.pinhole.width_px, camera.pinhole.height_px};
}

inline void make_all(hull::SkipMap& skip_map) {
  for (int box = 0; box < hull::kQuadrants; ++box)
    if (!skip_map.has(hull::Quadrant(box))) skip_map.make(hull::Quadrant(box));
}

inline hull::ObjectPixels random_pixels(Random& random, int width_px, int height_px,
                                        double fraction) {
  hull::ObjectPixels pixels(width_px, height_px);
  std::bernoulli_distribution object(fraction);
  for (int v = 0; v < height_px; ++v)
    for (int u = 0; u < width_px; ++u)
      if (object(random)) pixels.set(u, v);
  return pixels;
}

// Depth of one view by backend `cpu`.
inline hull::DepthTile cpu_depth(std::span<const hull::Silhouette> silhouettes,
                                 const hull::View& view, const hull::PixelRect& rect,
                                 int threads = 2) {
  base::WorkerPool pool(threads);
  return hull::CpuHull(pool, silhouettes).depth(view, rect);
}

}  // namespace fivepipe::test
