// Cameras and hull components for the tests of the component tracker.
#pragma once
#include <algorithm>

#include "common/collision/tracking/component_tracker.h"
#include "tests/support/collision/scene.h"

namespace fivepipe::test {

inline constexpr double kFrame_s = 1.0 / 60;

inline std::vector<geometry::Camera> lab_cameras() {
  std::vector<geometry::Camera> cameras = ring(4, 1.6, 0.75, 480, 1.1);
  for (const geometry::Camera& c : ring(4, 1.6, 0.3, 480, 1.1)) cameras.push_back(c);
  return cameras;
}

// Components of at least 20 cells, with outlines, of an object in the lab's volume. If `noise` is
// given, it flips border pixels, as camera noise does after the silhouettes are cleaned.
inline std::vector<collision::HullComponent> components_of(
    const std::vector<hull::Capsule>& object, const std::vector<geometry::Camera>& cameras,
    double cell_m, Random* noise = nullptr) {
  std::vector<hull::Silhouette> silhouettes = silhouettes_of(object, cameras);
  if (noise)
    for (hull::Silhouette& s : silhouettes) {
      const hull::ObjectPixels before = s.pixels;
      std::bernoulli_distribution flips(0.25);
      const hull::PixelRect bounds = before.bounds();
      for (int v = std::max(bounds.v0_px - 1, 0);
           v < std::min(bounds.v1_px + 1, before.height_px()); ++v)
        for (int u = std::max(bounds.u0_px - 1, 0);
             u < std::min(bounds.u1_px + 1, before.width_px()); ++u) {
          const bool here = before.contains(u, v);
          const auto other = [&](int du, int dv) {
            return before.contains(u + du, v + dv) != here;
          };
          const bool at_border = other(-1, 0) || other(1, 0) || other(0, -1) || other(0, 1);
          if (at_border && flips(*noise)) s.pixels.set(u, v, !here);
        }
    }
  base::WorkerPool pool(2);
  hull::CpuHull hull(pool, silhouettes);
  const Eigen::AlignedBox3d space(Eigen::Vector3d(-0.5, -0.5, -0.4),
                                  Eigen::Vector3d(0.5, 0.5, 0.4));
  return collision::hull_components(hull::HullQuery(hull), {space, cell_m, 20, true});
}

}  // namespace fivepipe::test
