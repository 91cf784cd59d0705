// Cameras in the form that the shaders of backend `gl` read (gl_contact_buffers.h), with bounds of
// the float errors.
#pragma once
#include "common/collision/detection/gl/gl_contact_buffers.h"
#include "common/hull/cpu/cpu_hull.h"

namespace fivepipe::collision {

// The pixel from which image positions count: the center of the object pixels' bounds.
struct BasePixel {
  int u, v;
};
BasePixel base_pixel(const hull::CpuHull::MapCamera& camera);

// Returns the projection of points of a frame that are at most radius_m from its origin. The caller
// sets first_byte and stride, which locate the camera's map.
gl_contact::GlCamera gl_camera(const hull::CpuHull::MapCamera& camera,
                               const Eigen::Isometry3d& world_from_frame, double radius_m);
// Returns whether float represents the projections of those points.
bool fits_float(const gl_contact::GlCamera& camera, double radius_m);

// Returns a point near the region that all cameras see: the one closest to the lines of sight
// through their base pixels and, in a direction that these leave undetermined, to the cameras.
Eigen::Vector3d world_origin_near_hull_m(const hull::CpuHull& hull);

}  // namespace fivepipe::collision
