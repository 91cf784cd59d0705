// Converts between fivepipe cameras and OpenGL clip space (x right, y up, -z forward, NDC -1..1).
// No other file does this conversion.
#pragma once
#include "common/geometry/camera.h"

namespace fivepipe::geometry {

// Returns clip_from_camera for a framebuffer of the pinhole's size. Camera pixel (u, v), row 0 at
// the top, maps to the center of framebuffer pixel (u, height - 1 - v), because GL counts rows from
// the bottom. NDC depth is -1 at near_m and +1 at far_m; 0 < near_m < far_m.
Eigen::Matrix4d gl_clip_from_camera(const Pinhole& pinhole, double near_m, double far_m);

// Returns texture_from_camera, which maps a point in the camera frame [m] to homogeneous texture
// coordinates (s q, t q, q) of the camera image. The image is uploaded with row 0 first. Texel (u,
// v) is centered at ((u + 0.5) / width, (v + 0.5) / height), so nearest sampling reads the unit
// square of the pixel.
Eigen::Matrix<double, 3, 4> texture_from_camera(const Pinhole& pinhole);

// Returns the camera depth [m] of a window depth in [0, 1], for gl_clip_from_camera() with the same
// near_m and far_m.
double depth_m_from_window_depth(double window_depth, double near_m, double far_m);

}  // namespace fivepipe::geometry
