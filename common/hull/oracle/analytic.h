// Analytic oracle: objects made of capsules, whose silhouettes are known in closed form (a sphere
// is a capsule of length zero). Synthetic cameras draw these silhouettes; tests and benchmarks
// compare results with them.
#pragma once
#include <span>
#include <vector>

#include "common/geometry/oriented_box.h"
#include "common/hull/hull.h"

namespace fivepipe::hull {

// All points within radius_m > 0 of the segment a-b.
struct Capsule {
  Eigen::Vector3d a_world_m, b_world_m;
  double radius_m;
};

// Returns the ray parameter (in units of the direction's length) at which the ray enters the
// capsule, 0 if its origin is inside, or nullopt if the ray misses or the capsule is behind the
// origin.
std::optional<double> ray_entry(const Capsule& capsule, const geometry::Ray& ray);

// Returns true if uv is in the true silhouette: the line of sight through uv meets a capsule in
// front of the camera.
bool in_silhouette(std::span<const Capsule> object, const geometry::Camera& camera,
                   const Eigen::Vector2d& uv_px);

// Returns true if p is in the hull of the true silhouettes, without pixels. As for in_hull(), a
// point outside the image of any camera is not in the hull.
bool in_analytic_hull(std::span<const Capsule> object, std::span<const geometry::Camera> cameras,
                      const Eigen::Vector3d& p_world_m);

// Rule by which a pixel is set:
//   center:  its centre is in the silhouette. The map omits up to half a pixel of the object.
//   touched: any part of its unit square is in the silhouette. The map contains the object.
enum class PixelRule { center, touched };
// Returns the pixels of the camera's image that the rule sets.
ObjectPixels true_object_pixels(std::span<const Capsule> object, const geometry::Camera& camera,
                                PixelRule rule);
// The same for a box, by PixelRule::center.
ObjectPixels true_object_pixels(const geometry::OrientedBox& box, const geometry::Camera& camera);

}  // namespace fivepipe::hull
