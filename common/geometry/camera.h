// Pinhole cameras and rigid poses.
// Frames: b_from_a maps coordinates in a to coordinates in b; adjacent names cancel. World:
// right-handed, z up, metres. Camera: x right, y down, z forward. Pixel (0,0) is the centre of the
// top-left pixel, so the image covers [-0.5, width - 0.5) x [-0.5, height - 0.5).
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <string>

namespace fivepipe::geometry {

// Intrinsics of an undistorted image without skew. fx_px and fy_px are > 0.
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
  // Of any length above 0. Rays of ray_through() have camera z 1, so their parameter is the camera
  // depth [m].
  Eigen::Vector3d direction_world;
};

// Returns the intrinsics of the same field of view at another image size.
Pinhole resized(const Pinhole& pinhole, int width_px, int height_px);

// Returns a pinhole with square pixels and the principal point at the image centre.
// horizontal_fov_rad is in (0, pi).
Pinhole pinhole_from_fov(int width_px, int height_px, double horizontal_fov_rad);

// Returns the pixel of a world point, which may be outside the image. Returns nullopt if the point
// is not in front of the camera (camera z <= 0 or NaN).
std::optional<Eigen::Vector2d> project(const Camera& camera, const Eigen::Vector3d& p_world_m);

// Returns the centre of projection [m, world].
Eigen::Vector3d camera_center_world_m(const Camera& camera);

// Returns the matrix that maps a point in the camera frame [m] to its homogeneous pixel (U, V, W).
// Pixel p covers [p, p + 1) of U / W, because half a pixel is added to the principal point. W is
// the depth [m].
Eigen::Matrix3d pixel_from_camera(const Pinhole& pinhole);
// Returns the same matrix with pixel centres at integers, as project() returns them.
Eigen::Matrix3d centered_pixel_from_camera(const Pinhole& pinhole);

// Returns the ray from the camera center through pixel position uv_px, which may be fractional.
Ray ray_through(const Camera& camera, const Eigen::Vector2d& uv_px);

// Returns camera_from_world of a camera at the eye that looks at the target, with up_world pointing
// up in the image. The viewing direction and up_world must not be parallel.
Eigen::Isometry3d look_at(const Eigen::Vector3d& eye_world_m, const Eigen::Vector3d& target_world_m,
                          const Eigen::Vector3d& up_world = Eigen::Vector3d::UnitZ());

// Returns the reason why the intrinsics or the pose are invalid: image size or focal length <= 0, a
// non-finite value, a rotation that is not orthonormal within kMaxRotationError, or a mirrored one.
// Returns nullopt if the camera is valid.
std::optional<std::string> why_unusable(const Camera& camera);

// Largest accepted element of |R^T R - I|. A calibration written with six digits is off by about
// 1e-6, far below the bound.
inline constexpr double kMaxRotationError = 1e-3;

// Returns the rotation nearest to the matrix in the Frobenius norm (by SVD). The matrix must be a
// rotation that why_unusable() accepts.
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix);

}  // namespace fivepipe::geometry
