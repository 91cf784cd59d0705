// Cameras as the shaders of backend `gl` have them (gl_contact_shaders.h), with the bound of what
// float may be off in them.
#pragma once
#include "common/collision/detection/gl/gl_contact_shaders.h"
#include "common/hull/cpu/cpu_hull.h"

namespace fivepipe::collision {

// Images are counted from there: the middle of the object pixels.
struct BasePixel {
  int u, v;
};
BasePixel base_pixel(const hull::CpuHull::MapCamera& camera);

// A camera that sees points of a frame, no farther than radius_m from its origin. The place of its
// map is left to who stores it.
gl_contact::GlCamera gl_camera(const hull::CpuHull::MapCamera& camera,
                               const Eigen::Isometry3d& world_from_frame, double radius_m);
// Float has room for all of them.
bool fits_float(const gl_contact::GlCamera& camera, double radius_m);

// Near what all cameras see: the lines of sight through their base pixels pass by it closest; where
// that leaves a direction open, near the cameras.
Eigen::Vector3d world_origin_near_hull_m(const hull::CpuHull& hull);

}  // namespace fivepipe::collision
