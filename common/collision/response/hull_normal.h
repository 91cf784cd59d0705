// N_hull: the normal of the hull where V_rec crosses its border.
#pragma once
#include "common/collision/response/recovery.h"
#include "common/collision/response/response.h"

namespace fivepipe::collision {

// V_rec as a ray from CP_obj with unit direction, and its exit from the hull. The base of triangle
// ABC is at reach_m.
struct Recovery {
  Eigen::Vector3d cp_object_world_m, v_rec_world;
  double reach_m;
  HullExit exit;
};

// Returns the normal by the paper's method, from the points I, J, K, L where the edges of ABC and
// DAE enter the hull. Computes these points exactly by rays, or by sampling if config.search is
// sampled.
HullNormal four_point_normal(const hull::HullQuery& query, const Recovery& recovery,
                             const ResponseConfig& config);

// Returns the normal in closed form: that of the plane through the tangent of the silhouette whose
// camera limits the hull at the exit (docs/collision.md).
HullNormal closed_form_normal(const hull::HullQuery& query, const Recovery& recovery);

// Maximum error of a defined normal: 45 degrees. A normal with a larger error describes the surface
// less well than V_rec does.
inline constexpr double kMaxNormalError_rad = 0.7853981634;

}  // namespace fivepipe::collision
