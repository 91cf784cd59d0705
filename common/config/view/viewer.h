// The viewer of a deployment: the path of its head, its eyes and the sizes of their images.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/geometry/camera.h"

namespace fivepipe::config {

// Position and viewing target of the eye at a time since the start.
struct HeadKey {
  double t_s;
  Eigen::Vector3d eye_world_m, target_world_m;
};

struct Viewer {
  std::string name = "viewer";
  // Piecewise smooth curve through the keys, repeated after the last one; one key: a fixed view.
  std::vector<HeadKey> path;
  // CSV file from which `path` was loaded (columns: t_s, eye x y z [m], target x y z [m]); empty:
  // the deployment file contains the keys.
  std::filesystem::path file;
  double horizontal_fov_rad = 1.0;
  int render_width_px = 640, render_height_px = 480;
  int recon_width_px = 320, recon_height_px = 240;
  double near_m = 0.05, far_m = 5.0;  // clip planes
  // Distance between the two eyes of a stereo viewer; nullopt: one eye, at the head's pose. Sizes
  // and field of view are those of each eye.
  std::optional<double> eye_distance_m;
};

// Return the pinholes of the view's two images, for rendering and for reconstruction. Both have the
// same field of view.
geometry::Pinhole render_pinhole(const Viewer& viewer);
geometry::Pinhole recon_pinhole(const Viewer& viewer);
// Returns camera_from_world of the head at a time since the start [s]: the pose of the only eye, or
// that in the middle between the two.
Eigen::Isometry3d eye_from_world_at(const Viewer& viewer, double t_s);

// Returns the positions of the eyes along the head's x axis [m], left before right; {0} unless the
// viewer is stereo.
std::vector<double> eye_positions_m(const Viewer& viewer);
// Returns eye_from_world of an eye at x_m along the head's x axis. Eyes have parallel axes.
Eigen::Isometry3d eye_at(double x_m, const Eigen::Isometry3d& head_from_world);
// Returns the width of the composite, which shows the eyes side by side [px].
int composite_width_px(const Viewer& viewer);

}  // namespace fivepipe::config
