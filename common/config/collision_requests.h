// Outputs that a scene requests of the collisions with real objects, in addition to each object's
// verdict and collision points. Outputs that are not requested are neither computed nor published.
#pragma once
#include <Eigen/Core>
#include <array>
#include <optional>

namespace fivepipe::config {

// How the response searches for the exit from the hull along V_rec. common/collision/response
// documents each search.
enum class RecoverySearch { from_reference, outward, sampled };

struct ResponseRequests {
  RecoverySearch search = RecoverySearch::from_reference;
  // Height of the paper's triangle ABC, and its angle BAC (10 degrees).
  double height_m = 0.05;
  double apex_angle_rad = 0.1745329252;
  // Direction of V_rec, not zero; absent: towards the object's centre.
  std::optional<Eigen::Vector3d> v_rec_world;
  // The hull's normal N_hull, from four points and in closed form.
  bool four_points = false, closed_form = false;
  // A verified translation out of the hull; a local minimum, not the global one.
  bool local_minimum_translation = false;
};

// Clearance between the object and the hull, per vertex or per triangle.
enum class ProximityOf { vertices, triangles };
struct ProximityRequests {
  ProximityOf of = ProximityOf::vertices;
  double cap_m = 0.05;         // larger distances are not resolved
  double tolerance_m = 0.002;  // maximum width of the interval around a distance below the cap
};

struct CollisionRequests {
  bool triangles = false;  // indices of the colliding and of the undecided triangles
  std::optional<ResponseRequests> response;
  int contacts = 0;  // maximum number of contact points, for a rigid-body solver
  std::optional<ProximityRequests> proximity;
  bool first_contact = false;  // time of first contact between two frames; needs HistoryRequests
  bool any() const { return triangles || response || contacts > 0 || proximity || first_contact; }
};

// Real objects warm a virtual one. Each vertex approaches the warmth of its place, which is 1 in
// the hull and 0 at the distance cap_m and beyond.
struct Warming {
  double cap_m = 0.06, tolerance_m = 0.005;              // as in ProximityRequests
  double heating_s = 0.5, cooling_s = 4.0;               // time constants
  std::array<double, 3> colour_rgb = {1.0, 0.25, 0.02};  // colour at warmth 1; 0 to 1, sRGB
};

// Tracks the hull's connected components from frame to frame.
struct HistoryRequests {
  double cell_m = 0.005;     // parts of the hull less than this apart are one component
  int window_frames = 8;     // number of frames over which a velocity is averaged
  double max_speed_m_s = 6;  // the tracker matches no component that would move faster
};
// Maximum number of cells of cell_m in the rig's volume, 2^27: bounds memory and time.
inline constexpr double kMaxHistoryCells = 1 << 27;

}  // namespace fivepipe::config
