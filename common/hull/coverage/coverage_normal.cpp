#include "common/hull/coverage/coverage_normal.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace fivepipe::hull {

using Eigen::Vector2d;
using Eigen::Vector3d;

std::optional<Vector2d> outward_in_image(const SparseCoverageMap& map, const Vector2d& uv_px) {
  if (!map.object().holds(uv_px.x(), uv_px.y())) return std::nullopt;
  // Least squares of coverage = a + g . (pixel - uv), weighted; g follows from the 3 x 3 normal
  // equations.
  const int u0 = int(std::lround(uv_px.x())) - kNormalWindow_px,
            v0 = int(std::lround(uv_px.y())) - kNormalWindow_px;
  constexpr int kSide = 2 * kNormalWindow_px + 1;
  std::array<double, kSide> weight_u, weight_v;
  const auto weight = [](double d) {
    return std::exp(-0.5 * d * d / (kNormalSigma_px * kNormalSigma_px));
  };
  for (int i = 0; i < kSide; ++i) {
    weight_u[i] = weight(u0 + i - uv_px.x());
    weight_v[i] = weight(v0 + i - uv_px.y());
  }
  Eigen::Matrix3d normal_matrix = Eigen::Matrix3d::Zero();
  Vector3d right_side = Vector3d::Zero();
  for (int v = std::max(v0, 0); v < std::min(v0 + kSide, map.height_px()); ++v)
    for (int u = std::max(u0, 0); u < std::min(u0 + kSide, map.width_px()); ++u) {
      const Vector3d row(1, u - uv_px.x(), v - uv_px.y());
      const Vector3d weighted = weight_u[u - u0] * weight_v[v - v0] * row;
      normal_matrix += weighted * row.transpose();
      right_side += map.at(u, v) * weighted;
    }
  const Vector2d gradient = normal_matrix.ldlt().solve(right_side).tail<2>();
  const double length = gradient.norm();
  if (!(length > kMinFall)) return std::nullopt;
  return -gradient / length;
}

std::optional<Vector3d> outward_normal_world(const CoverageSilhouette& silhouette,
                                             const Vector3d& p_world_m) {
  const auto uv_px = geometry::project(silhouette.camera, p_world_m);
  if (!uv_px) return std::nullopt;
  const auto outward = outward_in_image(silhouette.map, *uv_px);
  if (!outward) return std::nullopt;
  const geometry::Pinhole& k = silhouette.camera.pinhole;
  const Vector3d normal_camera(k.fx_px * outward->x(), k.fy_px * outward->y(),
                               outward->dot(Vector2d(k.cx_px, k.cy_px) - *uv_px));
  return (silhouette.camera.camera_from_world.linear().transpose() * normal_camera).normalized();
}

}  // namespace fivepipe::hull
