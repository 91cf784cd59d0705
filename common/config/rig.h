// The cameras of a rig: calibrated, and fixed in the world or mounted on the viewer's head. Read
// from a rig file.
#pragma once
#include <string>
#include <vector>

#include "common/geometry/camera.h"

namespace fivepipe::config {

// OpenCV's five-coefficient lens model of the captured image.
struct LensDistortion {
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
  bool none() const { return k1 == 0 && k2 == 0 && p1 == 0 && p2 == 0 && k3 == 0; }
};

// Where a camera is mounted: fixed in the world, or on the viewer's head.
enum class Mount { world, viewer };

struct RigCamera {
  std::string name;           // unique in the rig, [a-z0-9_]+
  geometry::Pinhole source;   // intrinsics of the captured image
  LensDistortion distortion;  // of the captured image
  // Undistorted pinhole of the published maps and colours; by default that of `source`.
  geometry::Pinhole published;
  Mount mount = Mount::world;
  // From the world frame, or from the viewer's eye (a camera frame).
  Eigen::Isometry3d camera_from_mount = Eigen::Isometry3d::Identity();
  bool gives_shape = true;   // publishes object-pixel maps; false for cameras on the viewer
  bool gives_colour = true;  // publishes colours
};

struct Rig {
  std::string name;
  Eigen::AlignedBox3d volume_m;  // world box that contains the real objects
  std::vector<RigCamera> cameras;
};

// Returns the published pinhole at the camera's pose. Only cameras on the viewer use
// eye_from_world.
geometry::Camera published_camera(const RigCamera& camera, const Eigen::Isometry3d& eye_from_world =
                                                               Eigen::Isometry3d::Identity());

// Returns the indices into rig.cameras of the cameras that give shape, in increasing order.
std::vector<std::size_t> shape_cameras(const Rig& rig);

}  // namespace fivepipe::config
