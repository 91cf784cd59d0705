#include "common/hull/image_cone.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

namespace fivepipe {
namespace {

// Roundings of a point's way to the camera, to its pixel and to its distance from a plane, each at most half of epsilon of the lengths
// that take part: fewer than 20; the rest is for the one who counts after me.
constexpr double kRoundings = 64 * std::numeric_limits<double>::epsilon();

// Distance [m] from the plane through the camera's centre and a line of pixel borders at `border`, positive beyond it (right, down).
double beyond(double x, double z, double focal_px, double principal_px, double border) {
  const double a = principal_px - border;
  return (focal_px * x + a * z) / std::sqrt(focal_px * focal_px + a * a);
}

struct FourFaces {
  double left, right, up, down;  // distances into the pyramid
};

FourFaces faces(const Pinhole& k, const Eigen::Vector3d& p, const PixelRect& rect) {
  return {beyond(p.x(), p.z(), k.fx_px, k.cx_px, rect.u0_px - 0.5), -beyond(p.x(), p.z(), k.fx_px, k.cx_px, rect.u1_px - 0.5),
          beyond(p.y(), p.z(), k.fy_px, k.cy_px, rect.v0_px - 0.5), -beyond(p.y(), p.z(), k.fy_px, k.cy_px, rect.v1_px - 0.5)};
}

}  // namespace

ImageCone::ImageCone(const Camera& camera) : camera_(camera) {
  const Eigen::Matrix3d r = camera.camera_from_world.linear();
  const double largest2 = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(r.transpose() * r, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
  world_per_camera_ = 1 / std::sqrt(largest2);
  const Pinhole& k = camera.pinhole;
  // A pixel's rounding is that of the principal point too: seen from a camera with a short focal length, the farther.
  rounding_ = kRoundings * (2 + std::max(std::abs(k.cx_px) / k.fx_px, std::abs(k.cy_px) / k.fy_px));
}

SeenPoint ImageCone::see(const Eigen::Vector3d& p_world_m) const {
  const Pinhole& k = camera_.pinhole;
  const Eigen::Vector3d p = camera_.camera_from_world * p_world_m;
  const double size_m = p_world_m.cwiseAbs().sum() + camera_.camera_from_world.translation().cwiseAbs().sum();
  return {p, rounding_ * size_m, k.fx_px * p.x() / p.z() + k.cx_px, k.fy_px * p.y() / p.z() + k.cy_px};
}

double ImageCone::inside_m(const SeenPoint& p, const PixelRect& rect) const {
  const FourFaces d = faces(camera_.pinhole, p.p_camera_m, rect);
  return (std::min(std::min(d.left, d.right), std::min(d.up, d.down)) - p.rounding_m) * world_per_camera_;
}

double ImageCone::outside_m(const SeenPoint& p, const PixelRect& rect) const {
  const FourFaces d = faces(camera_.pinhole, p.p_camera_m, rect);
  return (std::max({-d.left, -d.right, -d.up, -d.down, -p.p_camera_m.z()}) - p.rounding_m) * world_per_camera_;
}

}  // namespace fivepipe
