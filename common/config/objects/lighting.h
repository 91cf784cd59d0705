// The view in which the scene's light casts shadows.
#pragma once
#include <array>

#include "common/geometry/camera.h"

namespace fivepipe::config {

// The light's view of the scene. Points outside it are never in shadow.
struct ShadowView {
  Eigen::Vector3d target_world_m;                // the view's centre
  double fov_rad = 1.0;                          // of both directions
  double near_m = 0.1, far_m = 10;               // from the light along its view
  int map_px = 512;                              // edge of the square map of virtual objects
  std::array<int, 2> hull_size_px = {320, 240};  // of the light's view of the hull
};

}  // namespace fivepipe::config
