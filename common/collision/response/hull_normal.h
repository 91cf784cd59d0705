// N_hull: the normal of the hull where V_rec crosses its border.
#pragma once
#include "common/collision/response/recovery.h"
#include "common/collision/response/response.h"

namespace fivepipe::collision {

// V_rec as a ray: from CP_obj, unit direction, base at reach_m; and where it leaves the hull.
struct Recovery {
  Eigen::Vector3d cp_object_world_m, v_rec_world;
  double reach_m;
  HullExit exit;
};

// The paper's: from the points I, J, K, L where the edges of ABC and DAE enter the hull; by rays,
// or sampled where config.search is.
HullNormal four_point_normal(const hull::HullQuery& query, const Recovery& recovery,
                             const ResponseConfig& config);

// Closed form: the plane of the silhouette's tangent whose camera limits the hull there (design,
// "Response").
HullNormal closed_form_normal(const hull::HullQuery& query, const Recovery& recovery);

// A normal more uncertain than this says less about the surface than V_rec does: 45 degrees.
inline constexpr double kMaxNormalError_rad = 0.7853981634;

}  // namespace fivepipe::collision
