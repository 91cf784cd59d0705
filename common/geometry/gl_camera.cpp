#include "common/geometry/gl_camera.h"

namespace fivepipe::geometry {

Eigen::Matrix4d gl_clip_from_camera(const Pinhole& k, double near_m, double far_m) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Zero();
  m(0, 0) = 2 * k.fx_px / k.width_px;
  m(0, 2) = 2 * (k.cx_px + 0.5) / k.width_px - 1;
  m(1, 1) = -2 * k.fy_px / k.height_px;
  m(1, 2) = 1 - 2 * (k.cy_px + 0.5) / k.height_px;
  m(2, 2) = (far_m + near_m) / (far_m - near_m);
  m(2, 3) = -2 * far_m * near_m / (far_m - near_m);
  m(3, 2) = 1;
  return m;
}

Eigen::Matrix<double, 3, 4> texture_from_camera(const Pinhole& k) {
  Eigen::Matrix<double, 3, 4> m = Eigen::Matrix<double, 3, 4>::Zero();
  m(0, 0) = k.fx_px / k.width_px;
  m(0, 2) = (k.cx_px + 0.5) / k.width_px;
  m(1, 1) = k.fy_px / k.height_px;
  m(1, 2) = (k.cy_px + 0.5) / k.height_px;
  m(2, 2) = 1;
  return m;
}

double depth_m_from_window_depth(double window_depth, double near_m, double far_m) {
  return far_m * near_m / (far_m - window_depth * (far_m - near_m));
}

}  // namespace fivepipe::geometry
