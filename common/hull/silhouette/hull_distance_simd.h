// SIMD kernel of the distances to the hull's surface (hull_distance.h).
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "common/hull/silhouette/border_distance.h"

namespace fivepipe::hull {

struct DistanceSimdCamera {
  double pixel_from_world[12];  // rows; homogeneous, its w is the depth [m]
  double per_focal_px;          // 1 / mean focal length
  double image_width_px, image_height_px;
  BorderDistance::Region distance;
};

// The camera whose border limits the hull most at a point.
struct LimitingBorder {
  std::int32_t camera;  // index; -1: not within reach, or not defined
  double distance_px;   // to the border; positive in the silhouette
};

// Writes the limiting border of each point that is at most reach_m outside the hull. min_seen: 0 if
// all cameras limit the hull, or the number of cameras that must see the point, which alone limit
// it there. The result is the same with every instruction set.
void limiting_borders(std::span<const DistanceSimdCamera> cameras, int min_seen,
                      std::span<const Eigen::Vector3d> p_world_m, double reach_m,
                      LimitingBorder* borders);

}  // namespace fivepipe::hull
