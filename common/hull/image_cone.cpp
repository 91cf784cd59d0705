#include "common/hull/image_cone.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

namespace fivepipe::hull {
namespace {

// Bound of rounding from a world point to its camera point, its pixel and its distance from a
// plane: fewer than 20 roundings, each at most half an epsilon of the lengths involved. 64 leaves a
// margin.
constexpr double kRoundings = 64 * std::numeric_limits<double>::epsilon();

// Unit normal of the plane through the camera's centre and the pixel border at `border`. It points
// to larger pixel coordinates (right or down).
Eigen::Vector2d normal_beyond(double focal_px, double principal_px, double border) {
  const double a = principal_px - border, per_length = 1 / std::sqrt(focal_px * focal_px + a * a);
  return {focal_px * per_length, a * per_length};
}

double along(const Eigen::Vector2d& normal, double across_m, double z_m) {
  return normal.x() * across_m + normal.y() * z_m;
}

}  // namespace

ImageCone::ImageCone(const geometry::Camera& camera) : camera_(camera) {
  const Eigen::Matrix3d r = camera.camera_from_world.linear();
  const double largest2 =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(r.transpose() * r, Eigen::EigenvaluesOnly)
          .eigenvalues()
          .maxCoeff();
  world_per_camera_ = 1 / std::sqrt(largest2);
  translation_m_ = camera.camera_from_world.translation().cwiseAbs().sum();
  const geometry::Pinhole& k = camera.pinhole;
  // The principal point's rounding adds to the pixel's; it counts more for short focal lengths.
  rounding_ = kRoundings * (2 + std::max(std::abs(k.cx_px) / k.fx_px, std::abs(k.cy_px) / k.fy_px));
}

ProjectedPoint ImageCone::see(const Eigen::Vector3d& p_world_m) const {
  const geometry::Pinhole& k = camera_.pinhole;
  const Eigen::Vector3d p = camera_.camera_from_world * p_world_m;
  const double per_z = 1 / p.z();
  return {p, rounding_ * (p_world_m.cwiseAbs().sum() + translation_m_),
          k.fx_px * p.x() * per_z + k.cx_px, k.fy_px * p.y() * per_z + k.cy_px};
}

Pyramid ImageCone::pyramid(const PixelRect& rect) const {
  const geometry::Pinhole& k = camera_.pinhole;
  return {normal_beyond(k.fx_px, k.cx_px, rect.u0_px - 0.5),
          -normal_beyond(k.fx_px, k.cx_px, rect.u1_px - 0.5),
          normal_beyond(k.fy_px, k.cy_px, rect.v0_px - 0.5),
          -normal_beyond(k.fy_px, k.cy_px, rect.v1_px - 0.5)};
}

double ImageCone::inside_m(const ProjectedPoint& p, const Pyramid& pyramid) const {
  const Eigen::Vector3d& q = p.p_camera_m;
  const double sides_m =
      std::min(along(pyramid.left_xz, q.x(), q.z()), along(pyramid.right_xz, q.x(), q.z()));
  const double ends_m =
      std::min(along(pyramid.up_yz, q.y(), q.z()), along(pyramid.down_yz, q.y(), q.z()));
  return (std::min(sides_m, ends_m) - p.rounding_m) * world_per_camera_;
}

double ImageCone::outside_m(const ProjectedPoint& p, const Pyramid& pyramid) const {
  const Eigen::Vector3d& q = p.p_camera_m;
  const double sides_m =
      std::min(along(pyramid.left_xz, q.x(), q.z()), along(pyramid.right_xz, q.x(), q.z()));
  const double ends_m =
      std::min(along(pyramid.up_yz, q.y(), q.z()), along(pyramid.down_yz, q.y(), q.z()));
  return (-std::min(std::min(sides_m, ends_m), q.z()) - p.rounding_m) * world_per_camera_;
}

}  // namespace fivepipe::hull
