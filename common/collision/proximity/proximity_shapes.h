// Shapes that proximity queries accept: points and triangles. Each shape has a bounding box, the
// nearest of its points to a given one, and a lower bound of its distance to a cube.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/collision/detection/triangle.h"

namespace fivepipe::collision {

// Relative rounding error of a distance between points, per sum of their coordinates' sizes: fewer
// than 20 roundings.
inline constexpr double kDistanceRoundings = 32 * std::numeric_limits<double>::epsilon();

// Relative error of the nearest point of a sliver: about the square root of double's precision. If
// the sliver's height is below that, its barycentric weights are noise, and a point on one of its
// edges replaces the nearest point.
inline constexpr double kTriangleRounding = 1e-7;

struct PointShape {
  Eigen::Vector3d center;  // world [m]
  Eigen::Vector3d half_extents_m = Eigen::Vector3d::Zero();

  const Eigen::Vector3d& nearest_to(const Eigen::Vector3d&) const { return center; }
  // Returns the largest rounding error of distances up to reach_m.
  double rounding_m(double reach_m) const {
    return kDistanceRoundings * (center.cwiseAbs().sum() + reach_m);
  }
  // Returns a lower bound of the squared distance to a cube (center, half edge). to_box_m2: squared
  // distance between the shape's box and the cube.
  double to_cube_m2(const Eigen::Vector3d&, double, double to_box_m2) const { return to_box_m2; }
};

struct TriangleShape {
  Triangle t;
  Eigen::Vector3d center, half_extents_m;

  explicit TriangleShape(const Triangle& triangle) : t(triangle) {
    const Eigen::Vector3d low = t[0].cwiseMin(t[1]).cwiseMin(t[2]),
                          high = t[0].cwiseMax(t[1]).cwiseMax(t[2]);
    center = low / 2 + high / 2;
    half_extents_m = high / 2 - low / 2;
  }

  // Ericson, Real-Time Collision Detection, 2005, section 5.1. All candidates are points of the
  // triangle, even if their weights are inexact.
  Eigen::Vector3d nearest_to(const Eigen::Vector3d& p) const {
    Eigen::Vector3d nearest = t[0];
    const auto consider = [&](const Eigen::Vector3d& q) {
      if ((q - p).squaredNorm() < (nearest - p).squaredNorm()) nearest = q;
    };
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::Vector3d &a = t[i], ab = t[(i + 1) % 3] - a;
      const double length2 = ab.squaredNorm();
      if (length2 > 0) consider(a + std::clamp(ab.dot(p - a) / length2, 0.0, 1.0) * ab);
    }
    const Eigen::Vector3d ab = t[1] - t[0], ac = t[2] - t[0], ap = p - t[0], normal = ab.cross(ac);
    const double weight_b = ap.cross(ac).dot(normal), weight_c = ab.cross(ap).dot(normal),
                 sum = normal.squaredNorm();
    if (weight_b >= 0 && weight_c >= 0 && sum > 0 && weight_b + weight_c <= sum)
      consider(t[0] + weight_b / sum * ab + weight_c / sum * ac);
    return nearest;
  }
  double rounding_m(double reach_m) const {
    return kDistanceRoundings * (center.cwiseAbs().sum() + reach_m) +
           kTriangleRounding * (2 * half_extents_m.sum() + reach_m);
  }
  // The bound of the box suffices if the box is not larger than the cube.
  double to_cube_m2(const Eigen::Vector3d& center_world_m, double half_edge_m,
                    double to_box_m2) const {
    if (half_extents_m.maxCoeff() <= half_edge_m) return to_box_m2;
    const double to_m =
        (nearest_to(center_world_m) - center_world_m).norm() - std::sqrt(3.0) * half_edge_m;
    return to_m > 0 ? std::max(to_box_m2, to_m * to_m) : to_box_m2;
  }
};

}  // namespace fivepipe::collision
