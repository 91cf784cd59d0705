// How to move a virtual object out of the visual hull, and what the hull is like there (paper,
// section 4.3 and figure 3).
//
//        B ------- base ------- C    base: `height` from A along V_rec, and not beyond RP_obj
//         \         |          /
//          \        |         /      V_rec is searched from the base towards A: the first hull
//          point is CP_hull.
//           I---CP_hull------J       BA and CA likewise: I, J. The same in the plane across, DAE:
//           K, L.
//             \     |      /         N_hull = IJ x KL, turned so that N_hull . V_rec > 0.
//               \   |   /
//                 A = CP_obj         D_rec = |CP_hull - CP_obj|
//
// A suite: what a simulation does not ask for is not computed. Its parts stand alone in recovery.h
// (CP_obj, D_rec), hull_normal.h (N_hull), local_minimum_translation.h and contact_manifold.h
// (beyond the paper). The paper rendered ABC over a window and stepped through its pixels; here the
// lines are cut exactly by rays, or sampled at the window's pixels where the paper's way is asked
// for.
#pragma once
#include <functional>
#include <optional>

#include "common/collision/detection/detection.h"
#include "common/hull/query/hull_query.h"
#include "common/hull/silhouette/hull_border.h"

namespace fivepipe::collision {

// The collision of the object, moved by this vector from where it is, with the same hull: by
// whatever backend the caller has.
using Requery = std::function<ObjectCollision(const Eigen::Vector3d& move_world_m)>;

// Where on V_rec CP_hull is.
enum class HullSearch {
  from_reference,  // the first hull point from the base towards CP_obj; exact
  outward,  // the first exit of the hull from CP_obj towards the base; exact. Nearer where the hull
            // is not convex
  sampled   // as from_reference, at window_px samples as the paper does; the four points likewise
};

struct ResponseConfig {
  HullSearch search = HullSearch::from_reference;
  double height_m = 0.05;                // of triangle ABC
  double apex_angle_rad = 0.1745329252;  // BAC: 10 degrees; in (0, pi)
  int window_px = 400;                   // samples along each line, where sampled
};

struct RequestedNormals {
  bool four_points = false, closed_form = true;
};

struct ResponseRequest {
  Eigen::Vector3d rp_object_world_m;  // RP_obj, by default the object's centre
  std::optional<Eigen::Vector3d>
      v_rec_world;  // direction given by the simulation, of any length; else RP_obj - CP_obj
  RequestedNormals normals = {};
  // Collision points this little nearer to RP_obj than the farthest count as equally far, and of
  // those the one deepest in the hull, along its own way to RP_obj, is taken. For balls, all of
  // whose points are equally far but for the flatness of their triangles: the first one would as
  // soon lie at the rim of the contact as in its middle.
  double equally_far_m = 0;
};

enum class RecoveryStatus {
  recovered,        // moved by clear_distance_m() along V_rec and queried again: residual within
                    // indifferent_m()
  still_colliding,  // the same, with more than that left: another place of contact, or another part
                    // of the hull
  reference_inside,  // RP_obj is in the hull: nothing to search from. Not where V_rec is given, or
                     // the search goes outward
  no_exit_within_reach,  // the base of ABC is in the hull; outward: no exit before it
  direction_undefined,   // V_rec is zero or not finite
  no_collision_point  // no point of the surface collides; the hull may still lie wholly inside the
                      // object
};

enum class NormalStatus {
  defined,
  not_requested,       // or no CP_hull
  edge_starts_inside,  // four points: B, C, D or E is in the hull
  parallel,            // four points: I, J, K, L span no plane
  no_border,     // closed form: no silhouette's border is found where V_rec crosses the hull's
  too_uncertain  // error_rad above kMaxNormalError_rad; four points that span less than the maps
                 // resolve
};

struct HullNormal {
  NormalStatus status = NormalStatus::not_requested;
  Eigen::Vector3d normal_world = Eigen::Vector3d::Zero();  // unit, out of the hull, where defined
  // Four points: a sample's step and a pixel's footprint over the points' span. Closed form: the
  // standard error of the contour's fit.
  double error_rad = 0;
  std::vector<hull::LimitingCamera> cameras;  // closed form: more than one where CP_hull is on an
                                              // edge or a corner; the first has normal_world
};

struct Response {
  RecoveryStatus status = RecoveryStatus::direction_undefined;
  Eigen::Vector3d cp_object_world_m = Eigen::Vector3d::Zero();
  std::uint32_t cp_object_triangle = 0;
  // The rest holds where status is recovered or still_colliding.
  Eigen::Vector3d v_rec_world =
      Eigen::Vector3d::Zero();  // unit length; also for no_exit_within_reach
  Eigen::Vector3d cp_hull_world_m = Eigen::Vector3d::Zero();
  double d_rec_m = 0;
  double d_rec_error_m = 0;  // exact: in_hull() changes within this of d_rec_m; sampled: the hull
                             // ends before d_rec_m + d_rec_error_m
  double pixel_footprint_m = 0;  // largest pixel of the cameras at CP_hull: finer, the maps tell
                                 // nothing of the object's surface
  double residual_m = 0;  // after the move: farther way along V_rec until each of remaining_points
                          // has been outside; at most `height`
  std::vector<CollisionPoint> remaining_points;  // CP_i after the move by clear_distance_m()
  HullNormal four_points, closed_form;

  // The move that leaves CP_obj outside the hull; D_rec alone ends on its border.
  double clear_distance_m() const { return d_rec_m + d_rec_error_m; }
  double indifferent_m() const { return d_rec_error_m + pixel_footprint_m; }
  bool has_exit() const {
    return status == RecoveryStatus::recovered || status == RecoveryStatus::still_colliding;
  }
  // The closed form where it is defined, else the four points', whatever their status.
  const HullNormal& normal() const {
    return closed_form.status == NormalStatus::defined ? closed_form : four_points;
  }
};

// Against the query's hull. Throws std::invalid_argument where RP_obj or a collision point is not
// finite, the configuration is out of range, or there is no requery.
Response respond(const hull::HullQuery& query, const ObjectCollision& collision,
                 const ResponseRequest& request, const Requery& requery,
                 const ResponseConfig& config = {});

}  // namespace fivepipe::collision
