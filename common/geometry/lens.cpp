#include "common/geometry/lens.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace fivepipe::geometry {
namespace {

// 87 degrees off the axis, wider than any pinhole image.
constexpr double kMaxTangent = 20.0;

bool is_in_image(const Pinhole& captured, const Eigen::Vector2d& distorted_xy) {
  const double u = distorted_xy.x() * captured.fx_px + captured.cx_px,
               v = distorted_xy.y() * captured.fy_px + captured.cy_px;
  return u >= -0.5 && v >= -0.5 && u < captured.width_px - 0.5 && v < captured.height_px - 0.5;
}

}  // namespace

Eigen::Vector2d distorted(const LensDistortion& lens, const Eigen::Vector2d& xy) {
  const double x = xy.x(), y = xy.y(), r2 = x * x + y * y;
  const double radial = 1 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3));
  return {x * radial + 2 * lens.p1 * x * y + lens.p2 * (r2 + 2 * x * x),
          y * radial + lens.p1 * (r2 + 2 * y * y) + 2 * lens.p2 * x * y};
}

Eigen::Vector2d undistorted(const Pinhole& captured, const LensDistortion& lens,
                            const Eigen::Vector2d& uv_px) {
  const Eigen::Vector2d target((uv_px.x() - captured.cx_px) / captured.fx_px,
                               (uv_px.y() - captured.cy_px) / captured.fy_px);
  if (lens.none()) return target;
  constexpr int kMaxIterations = 60;
  // In normalised coordinates: 1e-6 px at f = 1000 px.
  constexpr double kConvergence = 1e-9;
  Eigen::Vector2d xy = target;
  for (int i = 0; i < kMaxIterations; ++i) {
    const double r2 = xy.squaredNorm();
    const double radial = 1 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3));
    const Eigen::Vector2d tangential = distorted(lens, xy) - radial * xy;
    const Eigen::Vector2d next = (target - tangential) / radial;
    const double change = (next - xy).norm();
    xy = next;
    if (!(change > kConvergence)) break;
  }
  return xy;
}

double monotonic_radius(const LensDistortion& lens) {
  constexpr double kStep = 0.005;
  for (double r = kStep; r < kMaxTangent; r += kStep) {
    const double r2 = r * r;
    if (!(1 + r2 * (3 * lens.k1 + r2 * (5 * lens.k2 + r2 * 7 * lens.k3)) > 0)) return r - kStep;
  }
  return std::numeric_limits<double>::infinity();
}

Pinhole whole_pinhole(const Pinhole& captured, const LensDistortion& lens) {
  if (lens.none()) return captured;
  const double radius = std::min(monotonic_radius(lens), kMaxTangent);
  // Pixel edges of the image.
  Eigen::AlignedBox2d image_px(Eigen::Vector2d(-0.5, -0.5),
                               Eigen::Vector2d(captured.width_px - 0.5, captured.height_px - 0.5));
  const auto extend = [&](const Eigen::Vector2d& xy) {
    image_px.extend(Eigen::Vector2d(xy.x() * captured.fx_px + captured.cx_px,
                                    xy.y() * captured.fy_px + captured.cy_px));
  };
  // The border of the image within the radius, and where the radius ends inside the image.
  const auto extend_by_pixel = [&](double u, double v) {
    const Eigen::Vector2d xy = undistorted(captured, lens, {u, v}),
                          back = distorted(lens, xy) -
                                 Eigen::Vector2d((u - captured.cx_px) / captured.fx_px,
                                                 (v - captured.cy_px) / captured.fy_px);
    constexpr double kConverged = 1e-6;
    if (xy.norm() < radius && back.norm() < kConverged) extend(xy);
  };
  const double right = captured.width_px - 0.5, bottom = captured.height_px - 0.5;
  for (int i = 0; i <= captured.width_px; ++i)
    for (const double v : {-0.5, bottom}) extend_by_pixel(i - 0.5, v);
  for (int i = 0; i <= captured.height_px; ++i)
    for (const double u : {-0.5, right}) extend_by_pixel(u, i - 0.5);
  constexpr int kDirections = 2048;
  for (int i = 0; i < kDirections; ++i) {
    const double angle = 2 * std::numbers::pi * i / kDirections;
    const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
    if (is_in_image(captured, distorted(lens, radius * direction))) extend(radius * direction);
  }
  const Eigen::Vector2d first = (image_px.min().array() + 0.5).floor(),
                        end = (image_px.max().array() + 0.5).ceil();
  // A model with extreme coefficients may need more pixels than an int holds, or infinitely many.
  constexpr int kMax_px = 1'000'000'000;
  const auto length = [&](int axis) {
    const double length_px = end[axis] - first[axis];
    return length_px < kMax_px ? int(length_px) : kMax_px;
  };
  return {length(0),
          length(1),
          captured.fx_px,
          captured.fy_px,
          captured.cx_px - first.x(),
          captured.cy_px - first.y()};
}

}  // namespace fivepipe::geometry
