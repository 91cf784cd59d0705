#include "common/geometry/camera.h"

#include <Eigen/SVD>
#include <cmath>

namespace fivepipe::geometry {

Pinhole resized(const Pinhole& pinhole, int width_px, int height_px) {
  const double sx = double(width_px) / pinhole.width_px, sy = double(height_px) / pinhole.height_px;
  return {width_px,
          height_px,
          pinhole.fx_px * sx,
          pinhole.fy_px * sy,
          (pinhole.cx_px + 0.5) * sx - 0.5,
          (pinhole.cy_px + 0.5) * sy - 0.5};
}

Pinhole pinhole_from_fov(int width_px, int height_px, double horizontal_fov_rad) {
  const double f = 0.5 * width_px / std::tan(0.5 * horizontal_fov_rad);
  return {width_px, height_px, f, f, 0.5 * (width_px - 1), 0.5 * (height_px - 1)};
}

std::optional<Eigen::Vector2d> project(const Camera& camera, const Eigen::Vector3d& p_world_m) {
  const Eigen::Vector3d p_camera = camera.camera_from_world * p_world_m;
  if (!(p_camera.z() > 0)) return std::nullopt;
  const Pinhole& k = camera.pinhole;
  return Eigen::Vector2d(k.fx_px * p_camera.x() / p_camera.z() + k.cx_px,
                         k.fy_px * p_camera.y() / p_camera.z() + k.cy_px);
}

Eigen::Vector3d camera_center_world_m(const Camera& camera) {
  return -(camera.camera_from_world.linear().transpose() * camera.camera_from_world.translation());
}

Eigen::Matrix3d pixel_from_camera(const Pinhole& pinhole) {
  Eigen::Matrix3d m;
  m << pinhole.fx_px, 0, pinhole.cx_px + 0.5, 0, pinhole.fy_px, pinhole.cy_px + 0.5, 0, 0, 1;
  return m;
}

Eigen::Matrix3d centered_pixel_from_camera(const Pinhole& pinhole) {
  Eigen::Matrix3d m;
  m << pinhole.fx_px, 0, pinhole.cx_px, 0, pinhole.fy_px, pinhole.cy_px, 0, 0, 1;
  return m;
}

Ray ray_through(const Camera& camera, const Eigen::Vector2d& uv_px) {
  const Pinhole& k = camera.pinhole;
  const Eigen::Vector3d d_camera((uv_px.x() - k.cx_px) / k.fx_px, (uv_px.y() - k.cy_px) / k.fy_px,
                                 1.0);
  return {camera_center_world_m(camera), camera.camera_from_world.linear().transpose() * d_camera};
}

Eigen::Isometry3d look_at(const Eigen::Vector3d& eye_world_m, const Eigen::Vector3d& target_world_m,
                          const Eigen::Vector3d& up_world) {
  const Eigen::Vector3d z = (target_world_m - eye_world_m).normalized();
  const Eigen::Vector3d x = z.cross(up_world).normalized();
  Eigen::Isometry3d camera_from_world = Eigen::Isometry3d::Identity();
  camera_from_world.linear().row(0) = x.transpose();
  camera_from_world.linear().row(1) = z.cross(x).transpose();
  camera_from_world.linear().row(2) = z.transpose();
  camera_from_world.translation() = -(camera_from_world.linear() * eye_world_m);
  return camera_from_world;
}

std::optional<std::string> why_unusable(const Camera& camera) {
  const Pinhole& k = camera.pinhole;
  if (!(k.width_px > 0 && k.height_px > 0)) return "image size is not positive";
  if (!(std::isfinite(k.fx_px) && std::isfinite(k.fy_px) && k.fx_px > 0 && k.fy_px > 0))
    return "focal length is not positive and finite";
  if (!(std::isfinite(k.cx_px) && std::isfinite(k.cy_px))) return "principal point is not finite";
  if (!camera.camera_from_world.matrix().allFinite()) return "pose is not finite";
  const Eigen::Matrix3d r = camera.camera_from_world.linear();
  if (!((r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <=
        kMaxRotationError))
    return "rotation is not orthonormal";
  if (!(r.determinant() > 0)) return "rotation is mirrored (determinant -1)";
  return std::nullopt;
}

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.matrixV().transpose();
}

}  // namespace fivepipe::geometry
