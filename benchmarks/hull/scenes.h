// What the hull benchmark looks at.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "common/hull/oracle/analytic.h"

namespace fivepipe::hull_bench {

struct HullScene {
  std::string name;
  std::vector<hull::Capsule> object;  // empty: real maps
  std::vector<hull::Silhouette> silhouettes;
  Eigen::Isometry3d camera_from_world_of_eye;
  double horizontal_fov_rad, near_m, far_m;  // of the view
  Eigen::AlignedBox3d volume_world_m;        // holds the hull: for methods that need to know
};

// An adult's hand and forearm [m]: wrist at the origin, fingers along x, 10 cm above the table.
std::vector<hull::Capsule> hand_and_forearm();

// Hand and forearm over a table, four cameras of 720x486 around it (rig table4: 40 degrees above
// the table), an eye beside them:
//   hand4        object pixels cover 5 % of the maps, the hull 8 % of the view
//   hand4-near   the cameras' lenses are longer: 15 % of the maps
//   sparse       the eye's lens is wider: 1 % of the view
//   dense        longer: 40 % of the view
//   hand16       sixteen cameras of 1280x720, 15 % of the maps
//   hand64       sixty-four of 640x480, 15 %
std::vector<HullScene> synthetic_scenes();

// The hand seen by `cameras` cameras of a size around it, by turns at three heights; coverage set
// by their field of view.
HullScene ring_scene(const std::string& name, int cameras, int width_px, int height_px,
                     double map_fov_rad);
// hand4 with other lenses.
HullScene hand_scene(const std::string& name, double map_fov_rad, double view_fov_rad);

// Real maps as `fivepipe maps` leaves them in a folder: cameras.txt, and a .pbm for each camera.
// Name and eye by the folder's name: seated4cam, balance4cam. Throws std::runtime_error naming the
// file and what is wrong with it.
HullScene real_scene(const std::filesystem::path& folder);

hull::View view_of(const HullScene& scene, int width_px, int height_px);
double covered_fraction(const HullScene& scene);

// How wide a map pixel is at the object [m]: the finest detail that the maps can tell. Mean over
// the cameras.
double pixel_footprint_m(const HullScene& scene);

}  // namespace fivepipe::hull_bench
