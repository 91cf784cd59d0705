#include "common/collision/detection/gl/gl_contact_camera.h"

#include <algorithm>
#include <cmath>

#include "common/collision/detection/cpu/contact_simd.h"

namespace fivepipe::collision {

using Eigen::Vector3d;
using gl_contact::GlCamera;

namespace {

// Bound of the float rounding of a form. A point of a triangle takes fewer than 20 roundings:
// vertices from double, edges, two fractions and their products, sums, a third. A form takes fewer
// than 12: coefficients from double, products, sums. GLSL rounds `precise` sums and products
// correctly but leaves the direction open (4.7.1), so each is off by at most 2^-23 of the sum of
// the terms' sizes, twice the error of rounding to nearest. It may flush subnormal numbers to zero,
// which is far below kMinMargin_px.
constexpr double kFormError = 32 * 0x1p-23;
constexpr double kMinMargin_px = 0x1p-20;
// Additional relative error of an image: a quotient is off by at most 2.5 units in the last place,
// 5 * 2^-24, and is rounded together with its margin.
constexpr double kImageError = 0x1p-20;
// Relative error of the margin itself: W is off by less than 1/64 if the margin is small enough,
// and the margin is rounded too.
constexpr double kMarginSlack = 1 + 1.0 / 32;
// Bound of the sums of forms [px m]: far below the largest float, also after products with pixels.
constexpr double kMaxFormTerm = 1e30;
// Weight of a camera's center, relative to the weight 1 of its line of sight.
constexpr double kCameraWeight = 1e-3;

}  // namespace

BasePixel base_pixel(const hull::CpuHull::MapCamera& camera) {
  const hull::PixelRect& bounds = camera.skip_map.bounds();
  return {(bounds.u0_px + bounds.u1_px) / 2, (bounds.v0_px + bounds.v1_px) / 2};
}

GlCamera gl_camera(const hull::CpuHull::MapCamera& camera,
                   const Eigen::Isometry3d& world_from_frame, double radius_m) {
  const hull::PixelRect &bounds = camera.skip_map.bounds(), &stored = camera.skip_map.stored();
  const auto [base_u, base_v] = base_pixel(camera);
  const PixelFromWorld pixel = pixel_from_world(camera.camera);
  Eigen::Matrix3d to_base = Eigen::Matrix3d::Identity();
  to_base(0, 2) = -base_u, to_base(1, 2) = -base_v;
  const Vector3d at =
      to_base * (pixel.leftCols<3>() * world_from_frame.translation() + pixel.col(3));
  const Eigen::Matrix3d of = to_base * pixel.leftCols<3>() * world_from_frame.linear();
  const Vector3d at_terms = at.cwiseAbs(), terms_per_m = of.cwiseAbs().rowwise().sum();
  const double farthest_px = 0.5 * std::max(bounds.width_px(), bounds.height_px()) + 1;
  const double image_px = std::max(std::abs(base_u), std::abs(base_v)) + farthest_px;
  // Bound of the error of U - u W, from the sizes of the terms.
  const auto error = [](double of_each, const Vector3d& terms, double u_px) {
    return of_each * (std::max(terms.x(), terms.y()) + u_px * terms.z()) * kMarginSlack;
  };
  // in_hull() projects in the world, where coordinates may be larger than relative to the frame's
  // origin.
  const Vector3d world_at_terms =
      pixel.cwiseAbs().leftCols<3>() * world_from_frame.translation().cwiseAbs() +
      pixel.col(3).cwiseAbs();
  const Vector3d world_terms_per_m = pixel.cwiseAbs().leftCols<3>().rowwise().sum();
  GlCamera c{};
  float* const columns[] = {c.of_x, c.of_y, c.of_z};
  for (int row = 0; row < 3; ++row) {
    c.at[row] = float(at[row]);
    for (int k = 0; k < 3; ++k) columns[k][row] = float(of(row, k));
  }
  c.of_x[3] = float(error(kFormError, at_terms, farthest_px) +
                    error(kProjectionError, world_at_terms, image_px));
  c.at[3] = float(error(kFormError, terms_per_m, farthest_px) +
                  error(kProjectionError, world_terms_per_m, image_px));
  c.of_y[3] = float((kFormError * (at_terms.z() + radius_m * terms_per_m.z()) +
                     kProjectionError * (world_at_terms.z() + radius_m * world_terms_per_m.z())) *
                    kMarginSlack);
  c.of_z[3] = float(kImageError + kMinMargin_px / farthest_px);
  const int lines[2][4] = {
      {stored.u0_px - base_u, stored.u1_px - 1 - base_u, stored.v0_px - base_v,
       stored.v1_px - 1 - base_v},
      {bounds.u0_px - base_u, bounds.u1_px - base_u, bounds.v0_px - base_v, bounds.v1_px - base_v}};
  for (int i = 0; i < 4; ++i) c.stored[i] = float(lines[0][i]), c.bounds[i] = float(lines[1][i]);
  c.farthest_px = float(farthest_px);
  // The bound of U - u W at u = farthest_px is at least farthest_px times the bound of W.
  c.behind = float(-2 / farthest_px);
  return c;
}

bool fits_float(const GlCamera& c, double radius_m) {
  double max_term = 0;
  for (int row = 0; row < 3; ++row)
    max_term = std::max(
        max_term, std::abs(c.at[row]) + radius_m * (std::abs(c.of_x[row]) + std::abs(c.of_y[row]) +
                                                    std::abs(c.of_z[row])));
  return max_term < kMaxFormTerm && c.farthest_px * kImageError < 0.5 * kMaxContactEps_px;
}

Vector3d world_origin_near_hull_m(const hull::CpuHull& hull) {
  Eigen::Matrix3d across = Eigen::Matrix3d::Zero();
  Vector3d at = Vector3d::Zero();
  for (const hull::CpuHull::MapCamera& c : hull.cameras()) {
    const auto [u, v] = base_pixel(c);
    const geometry::Ray ray = geometry::ray_through(c.camera, Eigen::Vector2d(u, v));
    const Vector3d d = ray.direction_world.normalized();
    const Eigen::Matrix3d off =
        Eigen::Matrix3d::Identity() * (1 + kCameraWeight) - d * d.transpose();
    across += off, at += off * ray.origin_world_m;
  }
  return across.ldlt().solve(at);
}

}  // namespace fivepipe::collision
