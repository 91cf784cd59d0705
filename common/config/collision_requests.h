// What a scene asks of the collisions with real objects, beyond each object's verdict and collision
// points. What is not asked for is neither computed nor sent.
#pragma once
#include <Eigen/Core>
#include <array>
#include <optional>

namespace fivepipe::config {

// How the hull's end is looked for along V_rec; common/collision/response.h says what each means.
enum class RecoverySearch { from_reference, outward, sampled };

struct ResponseRequests {
  RecoverySearch search = RecoverySearch::from_reference;
  double height_m = 0.05;                // of triangle ABC
  double apex_angle_rad = 0.1745329252;  // BAC: 10 degrees
  std::optional<Eigen::Vector3d>
      v_rec_world;  // direction, not zero; else towards the object's centre
  bool four_points = false, closed_form = false;  // N_hull
  bool local_minimum_translation = false;
};

enum class ProximityOf { vertices, triangles };
struct ProximityRequests {
  ProximityOf of = ProximityOf::vertices;
  double cap_m = 0.05, tolerance_m = 0.002;
};

struct CollisionRequests {
  bool triangles = false;  // which collide, which touch
  std::optional<ResponseRequests> response;
  int contacts = 0;  // at most so many, for a rigid-body solver
  std::optional<ProximityRequests> proximity;
  bool first_contact = false;  // with what moves between two frames; needs HistoryRequests
  bool any() const { return triangles || response || contacts > 0 || proximity || first_contact; }
};

// Each vertex takes on the warmth of what is near: 1 in the hull, 0 from the cap on, with these
// time constants.
struct Warming {
  double cap_m = 0.06, tolerance_m = 0.005;
  double heating_s = 0.5, cooling_s = 4.0;
  std::array<double, 3> colour_rgb = {1.0, 0.25, 0.02};  // at warmth 1; 0..1, sRGB
};

// The hull's connected parts, followed from frame to frame.
struct HistoryRequests {
  double cell_m = 0.005;     // what lies nearer together than this is one part
  int window_frames = 8;     // velocities are averages over
  double max_speed_m_s = 6;  // nothing moves faster
};
// Of the rig's volume.
inline constexpr double kMaxHistoryCells = 1 << 27;

}  // namespace fivepipe::config
