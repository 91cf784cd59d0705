// Queries the visual hull of a ball that three cameras see: is a point in the hull, how far is it
// from it, and where does a ray enter it.
#include <fivepipe.h>

#include <iostream>
#include <vector>

#include "common/hull/query/hull_query.h"

using Eigen::Vector3d;
namespace hull = fivepipe::hull;
namespace geometry = fivepipe::geometry;

constexpr double kRadius_m = 0.1;

// A camera at `eye` that looks at the origin, and its object pixels: those whose centre sees the
// ball around the origin.
hull::Silhouette silhouette_from(const Vector3d& eye_world_m) {
  hull::Silhouette silhouette{
      {{640, 480, 500, 500, 319.5, 239.5}, geometry::look_at(eye_world_m, Vector3d::Zero())},
      {640, 480}};
  for (int v = 0; v < 480; ++v)
    for (int u = 0; u < 640; ++u) {
      const Vector3d direction = geometry::ray_through(silhouette.camera, Eigen::Vector2d(u, v))
                                     .direction_world.normalized();
      if (eye_world_m.cross(direction).norm() < kRadius_m) silhouette.pixels.set(u, v);
    }
  return silhouette;
}

int main() {
  std::vector<hull::Silhouette> silhouettes;
  for (const Vector3d eye : {Vector3d(1, 0, 0), Vector3d(0, 1, 0.2), Vector3d(-0.2, 0.3, 1)})
    silhouettes.push_back(silhouette_from(eye));
  fivepipe::base::WorkerPool pool(2);  // threads
  hull::CpuHull cpu_hull(pool, silhouettes);
  const hull::HullQuery query(cpu_hull);
  std::cout << "centre in the hull: " << query.contains(Vector3d::Zero()) << '\n'
            << "free around (0.3, 0, 0): " << query.free_radius_m({0.3, 0, 0}) << " m\n";
  const geometry::Ray ray{{0.5, 0.01, 0.02}, {-1, 0, 0}};
  if (const auto entry = query.first_entry(ray, 0, 1))
    std::cout << "the ray enters after " << *entry << " m\n";
  std::cout << "the topic of object pixels has the type "
            << fivepipe_v1_ObjectPixelMap_desc.m_typename << '\n';
}
