#include "common/collision/response/ball_contact.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/hull/silhouette/hull_border.h"

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

// Silhouettes whose border is farther from the contact do not limit the hull there.
constexpr int kReach_px = 6;
// The planes are those at the last point, which moves half of the way to the nearest point of their
// intersection: the whole way overshoots on a round hull.
constexpr int kSteps = 8;
constexpr double kStep = 0.5;
// A nearest point that is closer to the centre, in radii, gives no direction.
constexpr double kMinDistance = 0.1;

bool is_certain(const std::vector<hull::TangentPlane>& planes, const Vector3d& touch_m) {
  constexpr double kTouching_m = 1e-6;  // above the rounding of nearest_in()
  return std::all_of(planes.begin(), planes.end(), [&](const hull::TangentPlane& plane) {
    return (plane.error_rad <= kMaxPlaneError_rad && plane.thickness_px >= kMinThickness_px) ||
           plane.normal_world.dot(touch_m) < plane.offset_m - kTouching_m;
  });
}

}  // namespace

Vector3d ball_contact_normal(const hull::HullQuery& query, const Vector3d& center_world_m,
                             double radius_m, const Vector3d& normal_world) {
  Vector3d at_m = center_world_m - radius_m * normal_world, normal = normal_world;
  for (int step = 0; step < kSteps; ++step) {
    const std::vector<hull::TangentPlane> planes = hull::tangent_planes(query, at_m, kReach_px);
    const auto nearest = hull::nearest_in(planes, center_world_m);
    if (!nearest || !((center_world_m - *nearest).norm() > kMinDistance * radius_m))
      return normal_world;
    normal = (center_world_m - *nearest).normalized();
    at_m += kStep * (*nearest - at_m);
    if (step + 1 == kSteps && !is_certain(planes, *nearest)) return normal_world;
  }
  return normal.dot(normal_world) >= std::cos(kMaxBallTurn_rad) ? normal : normal_world;
}

}  // namespace fivepipe::collision
