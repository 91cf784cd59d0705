// The cameras of a rig: calibrated, and fixed in the world or mounted on the viewer's head. Read
// from a rig file.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "common/geometry/camera.h"
#include "common/geometry/lens.h"

namespace fivepipe::config {

// Where a camera is mounted: fixed in the world, or on the viewer's head.
enum class Mount { world, viewer };

struct RigCamera {
  std::string name;                     // unique in the rig, [a-z0-9_]+
  geometry::Pinhole source;             // intrinsics of the captured image
  geometry::LensDistortion distortion;  // of the captured image
  // Undistorted pinhole of the published maps and colours; by default geometry::whole_pinhole().
  geometry::Pinhole published;
  Mount mount = Mount::world;
  // From the world frame, or from the viewer's eye (a camera frame).
  Eigen::Isometry3d camera_from_mount = Eigen::Isometry3d::Identity();
  // RMS reprojection error of the calibration, in pixels of the captured image; nullopt: unknown.
  std::optional<double> calibration_error_px = {};
  bool gives_shape = true;   // publishes object-pixel maps; false for cameras on the viewer
  bool gives_colour = true;  // publishes colours
};

struct Rig {
  std::string name;
  Eigen::AlignedBox3d volume_m;  // world box that contains the real objects; limits the hull
  std::vector<RigCamera> cameras;
  // Names of the rig file's cameras that the deployment leaves out; they are not in `cameras`.
  std::vector<std::string> left_out = {};
};

// Returns the published pinhole at the camera's pose. Only cameras on the viewer use
// eye_from_world.
geometry::Camera published_camera(const RigCamera& camera, const Eigen::Isometry3d& eye_from_world =
                                                               Eigen::Isometry3d::Identity());

// Returns the indices into rig.cameras of the cameras that give shape, in increasing order.
std::vector<std::size_t> shape_cameras(const Rig& rig);

}  // namespace fivepipe::config
