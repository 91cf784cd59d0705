// Pinhole cameras and rigid poses.
// Frames: b_from_a maps coordinates in a to coordinates in b; adjacent names cancel. World:
// right-handed, z up, metres. Camera: x right, y down, z forward. Pixel (0,0) is the centre of the
// top-left pixel, so the image covers
// [-0.5, width - 0.5) x [-0.5, height - 0.5).
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <string>

namespace fivepipe::geometry {

// Intrinsics of an undistorted image. fx, fy > 0; no skew.
struct Pinhole {
  int width_px = 0, height_px = 0;
  double fx_px = 0, fy_px = 0, cx_px = 0, cy_px = 0;
  bool operator==(const Pinhole&) const = default;
};

struct Camera {
  Pinhole pinhole;
  Eigen::Isometry3d camera_from_world = Eigen::Isometry3d::Identity();
};

struct Ray {
  Eigen::Vector3d origin_world_m;
  Eigen::Vector3d direction_world;  // not normalised: its camera z is 1, so the ray parameter is
                                    // the camera's depth [m]
};

// The same field of view at another image size; exact for pixel (0,0) at a pixel's centre.
Pinhole resized(const Pinhole& pinhole, int width_px, int height_px);

// A pinhole with a horizontal field of view [rad] and square pixels, principal point at the image's
// middle.
Pinhole pinhole_from_fov(int width_px, int height_px, double horizontal_fov_rad);

// Pixel of a world point [m]; nothing where the point is not in front of the camera (Z <= 0 or
// NaN). The pixel may lie outside the image.
std::optional<Eigen::Vector2d> project(const Camera& camera, const Eigen::Vector3d& p_world_m);

Eigen::Vector3d camera_center_world_m(const Camera& camera);

// Homogeneous pixel (U, V, W) from a point in the camera frame [m], where pixel p covers [p, p + 1)
// of U / W: half a pixel is added to the principal point. W is the depth [m].
Eigen::Matrix3d pixel_from_camera(const Pinhole& pinhole);
// The same with pixel centres at integers, as project() returns them.
Eigen::Matrix3d centered_pixel_from_camera(const Pinhole& pinhole);

Ray ray_through(const Camera& camera, const Eigen::Vector2d& uv_px);

// camera_from_world of a camera at eye looking at target, image up along up_world. The three must
// not be collinear.
Eigen::Isometry3d look_at(const Eigen::Vector3d& eye_world_m, const Eigen::Vector3d& target_world_m,
                          const Eigen::Vector3d& up_world = Eigen::Vector3d::UnitZ());

// Why these intrinsics or this pose can't be used (non-finite, focal length <= 0, rotation not
// orthonormal within kMaxRotationError, mirrored); nothing where they can.
std::optional<std::string> why_unusable(const Camera& camera);

// Largest |R^T R - I| element accepted; calibrations written with six digits are about 1e-6 off.
inline constexpr double kMaxRotationError = 1e-3;

// The nearest rotation (SVD); for matrices that why_unusable accepts.
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix);

}  // namespace fivepipe::geometry
