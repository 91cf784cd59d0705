// Objects whose silhouettes are known in closed form: capsules (a sphere is a capsule of length
// zero). The oracle for maps and hulls: synthetic cameras draw these, tests and benchmarks compare
// with them.
#pragma once
#include <span>
#include <vector>

#include "common/hull/hull.h"

namespace fivepipe::hull {

// All points within radius_m of the segment a-b, world [m]; radius_m > 0.
struct Capsule {
  Eigen::Vector3d a_world_m, b_world_m;
  double radius_m;
};

// Depth along the ray (its parameter, not normalised) at which it enters the capsule from outside;
// nothing where it misses or the capsule lies behind the origin; 0 where the origin is inside.
std::optional<double> ray_entry(const Capsule& capsule, const geometry::Ray& ray);

// The line of sight through uv meets one of the capsules in front of the camera: uv is in the true
// silhouette.
bool in_silhouette(std::span<const Capsule> object, const geometry::Camera& camera,
                   const Eigen::Vector2d& uv_px);

// Membership in the hull of the true silhouettes: no pixels involved. Image borders count as for
// in_hull (outside any image: not in).
bool in_analytic_hull(std::span<const Capsule> object, std::span<const geometry::Camera> cameras,
                      const Eigen::Vector3d& p_world_m);

// centre: a pixel is set where its centre is in the silhouette (cuts off up to half a pixel of the
// object). touched: where any of its unit square is (contains the object).
enum class PixelRule { center, touched };
ObjectPixels true_object_pixels(std::span<const Capsule> object, const geometry::Camera& camera,
                                PixelRule rule);

}  // namespace fivepipe::hull
