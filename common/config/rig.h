// The cameras of a rig: calibrated, fixed in the world or carried by the viewer's head.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "common/geometry/camera.h"

namespace fivepipe::config {

// OpenCV's five-coefficient lens model of the source image.
struct LensDistortion {
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
  bool none() const { return k1 == 0 && k2 == 0 && p1 == 0 && p2 == 0 && k3 == 0; }
};

enum class Mount { world, viewer };

struct RigCamera {
  std::string name;             // unique in the rig, [a-z0-9_]+
  geometry::Pinhole source;     // intrinsics of the image as captured
  LensDistortion distortion;    // of the image as captured
  geometry::Pinhole published;  // undistorted model that maps and colour are published in; the
                                // source's own unless stated
  Mount mount = Mount::world;
  Eigen::Isometry3d camera_from_mount =
      Eigen::Isometry3d::Identity();  // from the world, or from the viewer's eye (a camera frame)
  bool gives_shape = true;  // object-pixel maps; never for cameras that the viewer carries
  bool gives_colour = true;
};

struct Rig {
  std::string name;
  Eigen::AlignedBox3d volume_m;  // world box in which objects are expected
  std::vector<RigCamera> cameras;
};

// The published pinhole at the camera's pose; eye_from_world is used by cameras that the viewer
// carries.
geometry::Camera published_camera(const RigCamera& camera, const Eigen::Isometry3d& eye_from_world =
                                                               Eigen::Isometry3d::Identity());

// Indices into rig.cameras of those that give shape, in the rig's order.
std::vector<std::size_t> shape_cameras(const Rig& rig);

// Throws ConfigError listing every problem of the file.
Rig load_rig(const std::filesystem::path& file);

}  // namespace fivepipe::config
