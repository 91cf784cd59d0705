// How to move a virtual object out of the visual hull (paper, section 4.3 and figure 3).
//
//        B ------- base ------- C    base: `height` from A along V_rec, and not beyond RP_obj
//         \         |          /
//          \        |         /      V_rec is searched from the base towards A: the first hull point is CP_hull.
//           I---CP_hull------J       BA and CA likewise: I, J. The same in the plane across, DAE: K, L.
//             \     |      /         N_hull = IJ x KL, turned so that N_hull . V_rec > 0.
//               \   |   /
//                 A = CP_obj         D_rec = |CP_hull - CP_obj|
//
// The paper rendered ABC over its whole window, V_rec along a scan line, and stepped through the pixels. Here the five lines
// alone are sampled, at the same window_px pixel centres, by in_hull() in double: the same points, without rounding, and no
// window to render.
#pragma once
#include <optional>

#include "common/collision/detection.h"

namespace fivepipe {

struct ResponseConfig {
  double height_m = 0.05;                // of triangle ABC
  double apex_angle_rad = 0.1745329252;  // BAC: 10 degrees; in (0, pi)
  int window_px = 400;                   // samples along each line
};

struct ResponseRequest {
  Eigen::Vector3d rp_object_world_m;           // RP_obj, by default the object's centre
  std::optional<Eigen::Vector3d> v_rec_world;  // direction given by the simulation, of any length; else RP_obj - CP_obj
  bool normal_wanted = true;
  // Collision points this little nearer to RP_obj than the farthest count as equally far, and of those the one deepest in the
  // hull, along its own way to RP_obj, is taken. For balls, all of whose points are equally far but for the flatness of their
  // triangles: the first one would as soon lie at the rim of the contact as in its middle.
  double equally_far_m = 0;
};

enum class RecoveryStatus {
  recovered,            // moved by clear_distance_m() along V_rec and queried again: residual within d_rec_error_m + pixel_footprint_m
  still_colliding,      // the same, with more than that left: another place of contact, or another part of the hull
  reference_inside,     // RP_obj is in the hull: nothing to search from
  no_exit_within_reach, // the base of ABC is in the hull
  direction_undefined   // the given V_rec is zero
};

enum class NormalStatus {
  defined,
  not_asked,          // or no CP_hull
  edge_starts_inside, // B, C, D or E is in the hull
  parallel,           // I, J, K, L span no plane
  too_uncertain       // n_hull_error_rad above kMaxNormalErrorRad: the points span less than the maps resolve
};

struct Response {
  RecoveryStatus status = RecoveryStatus::direction_undefined;
  Eigen::Vector3d cp_object_world_m = Eigen::Vector3d::Zero();
  std::uint32_t cp_object_triangle = 0;
  // The rest holds where status is recovered or still_colliding.
  Eigen::Vector3d v_rec_world = Eigen::Vector3d::Zero();  // unit length; also for no_exit_within_reach
  Eigen::Vector3d cp_hull_world_m = Eigen::Vector3d::Zero();
  double d_rec_m = 0;
  double d_rec_error_m = 0;  // length searched / window_px: the hull ends on V_rec between d_rec_m and d_rec_m + d_rec_error_m
  double pixel_footprint_m = 0;  // largest pixel of the cameras at CP_hull: finer, the maps tell nothing of the object's surface
  double residual_m = 0;     // after the move: farther way along V_rec until every sample of the surface has been outside
  std::vector<CollisionPoint> points_left;  // CP_i after the move by clear_distance_m()
  NormalStatus normal = NormalStatus::not_asked;
  Eigen::Vector3d n_hull_world = Eigen::Vector3d::Zero();  // unit length, where normal is defined
  double n_hull_error_rad = 0;  // estimate: a sample's step and a pixel's footprint over the points' span

  // The move that leaves CP_obj outside the hull; D_rec alone ends on its last sample inside.
  double clear_distance_m() const { return d_rec_m + d_rec_error_m; }
};

// For an object that collides, against query.silhouettes(): CP_obj is the collision point farthest from RP_obj, of equals the
// first in the order of collision.points (lowest triangle) unless equally_far_m says otherwise. Throws std::invalid_argument where
// collision has no points, the request is not finite, or the configuration out of range.
Response respond(TriangleVolumeQuery& query, std::span<const Triangle> object_world_m, const ObjectCollision& collision,
                 const ResponseRequest& request, const ResponseConfig& config = {});

// A normal more uncertain than this says less about the surface than V_rec does: 45 degrees.
inline constexpr double kMaxNormalErrorRad = 0.7853981634;

}  // namespace fivepipe
