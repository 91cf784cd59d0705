// The hull's surface in closed form, to hold normals against: that of capsules' true silhouettes,
// which no pixel has touched.
#pragma once
#include <cstddef>
#include <optional>
#include <span>

#include "common/hull/oracle/analytic.h"

namespace fivepipe::collision_bench {

struct AnalyticExit {
  double distance_m;
  std::size_t camera;            // whose cone of sight ends there
  Eigen::Vector3d normal_world;  // unit, out of the hull
};

// The border between a point of the way in the hull of the true silhouettes and one that is not, by
// halving. Nothing where these are not such.
std::optional<AnalyticExit> analytic_exit(std::span<const hull::Capsule> object,
                                          std::span<const geometry::Camera> cameras,
                                          const geometry::Ray& way, double inside_m,
                                          double outside_m);

// Of the cone of sight tangent to the capsules, through a point on it: from the capsule that the
// line of sight touches to that line, by the shortest way.
Eigen::Vector3d cone_normal(std::span<const hull::Capsule> object,
                            const Eigen::Vector3d& eye_world_m, const Eigen::Vector3d& p_world_m);

double angle_deg(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

}  // namespace fivepipe::collision_bench
