// The one conversion between this project's cameras and OpenGL's clip space (x right, y up, -z
// forward, NDC -1..1).
#pragma once
#include "common/geometry/camera.h"

namespace fivepipe::geometry {

// clip_from_camera for a framebuffer of the pinhole's size: camera pixel (u, v) with row 0 at the
// top lands on the centre of the framebuffer pixel (u, height - 1 - v), GL's rows counting from the
// bottom. NDC depth -1 at near_m, +1 at far_m.
Eigen::Matrix4d gl_clip_from_camera(const Pinhole& pinhole, double near_m, double far_m);

// texture_from_camera: homogeneous (s q, t q, q) of a point in the camera's frame for the camera's
// image uploaded with row 0 first; texel (u, v) is centred at ((u + 0.5) / width, (v + 0.5) /
// height), so nearest sampling reads the pixel's unit square.
Eigen::Matrix<double, 3, 4> texture_from_camera(const Pinhole& pinhole);

// Camera depth [m] of a window depth in [0, 1].
double depth_m_from_window_depth(double window_depth, double near_m, double far_m);

}  // namespace fivepipe::geometry
