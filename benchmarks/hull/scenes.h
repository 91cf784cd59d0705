// The scenes of the hull benchmark.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "common/hull/oracle/analytic.h"

namespace fivepipe::hull_bench {

struct HullScene {
  std::string name;
  std::vector<hull::Capsule> object;  // empty for real maps
  std::vector<hull::Silhouette> silhouettes;
  Eigen::Isometry3d camera_from_world_of_eye;
  double horizontal_fov_rad, near_m, far_m;  // of the view
  Eigen::AlignedBox3d volume_world_m;        // contains the hull, for methods that need a volume
};

// An adult's hand and forearm: the wrist 10 cm above the origin, the fingers along x.
std::vector<hull::Capsule> hand_and_forearm();

// Hand and forearm above a table, seen by four cameras of 720x486 at an elevation of 40 degrees,
// and an eye beside them:
//   hand4        object pixels cover 5 % of the maps, the hull covers 8 % of the view
//   hand4-near   cameras with a narrower field of view: 15 % of the maps
//   sparse       an eye with a wider field of view: 1 % of the view
//   dense        an eye with a narrower field of view: 40 % of the view
//   hand16       16 cameras of 1280x720, 16 % of the maps
//   hand64       64 cameras of 640x480, 15 % of the maps
std::vector<HullScene> synthetic_scenes();

// The hand seen by a ring of `cameras` cameras, alternating between three elevations. Their field
// of view determines the coverage.
HullScene ring_scene(const std::string& name, int cameras, int width_px, int height_px,
                     double map_fov_rad);
// hand4 with other fields of view.
HullScene hand_scene(const std::string& name, double map_fov_rad, double view_fov_rad);

// The scenes of the series over the number of cameras and over coverage: ring4 to ring64, with maps
// of 720x486, and cover46 to cover220, which are hand4 with other fields of view.
std::vector<HullScene> series_scenes();

// Reads real maps from a folder that `fivepipe maps` has written: cameras.txt, volume.txt, and a
// .pbm file per camera. The scene has the folder's name. Its eye sees the whole volume; that of
// seated4cam and balance4cam is the one of the published figures. Throws std::runtime_error that
// names the file and the error.
HullScene real_scene(const std::filesystem::path& folder);

// The view of the scene's eye.
hull::View view_of(const HullScene& scene, int width_px, int height_px);
double covered_fraction(const HullScene& scene);  // of the maps, by object pixels

// The width of a map pixel at the object in m, which limits the detail of the maps. Mean over the
// cameras.
double pixel_footprint_m(const HullScene& scene);

}  // namespace fivepipe::hull_bench
