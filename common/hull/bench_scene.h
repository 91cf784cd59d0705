// What the hull benchmark looks at: a hand with forearm over a table, four cameras around it, an eye beside them.
#pragma once
#include <string>
#include <vector>

#include "common/hull/analytic.h"

namespace fivepipe::bench {

struct HullScene {
  std::string name;
  std::vector<Capsule> object;
  std::vector<Silhouette> silhouettes;  // touched
  Eigen::Isometry3d camera_from_world_of_eye;
};

// Four cameras of 720x486, 1.4 m from the hand and 40 degrees above the table; their field of view [rad] sets how much of the
// images the object covers.
HullScene hand_scene(const std::string& name, double horizontal_fov_rad);

double covered_fraction(const HullScene& scene);

// How wide a map pixel is at the object [m]: the finest detail that the maps can tell.
double pixel_footprint_m(const HullScene& scene);

}  // namespace fivepipe::bench
