// The simulation pipe: virtual objects under gravity, in contact with each other and with the
// visual hull (paper, section 4).
#pragma once
#include <optional>

#include "common/collision/detection/cpu/cpu_detector.h"
#include "common/collision/detection/gl/gl_detector.h"
#include "common/collision/detection/paper/paper_detector.h"
#include "common/config/deployment.h"
#include "sim_node/collision_details.h"
#include "sim_node/hull_history.h"
#include "sim_node/rigid_bodies.h"
#include "sim_node/warmth.h"

namespace fivepipe::sim {

struct ObjectState {
  std::string name;
  Eigen::Isometry3d world_from_object = Eigen::Isometry3d::Identity();
  Eigen::Vector3d velocity_world_m_s = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d>
      vertices_m;  // in the object's frame, where they deform; empty: rigid, the mesh as loaded
  std::vector<float> warmth;  // by vertex, where the object is warmed
};

// An object against the hull. For Reaction::bounce it tells of the last contact since the
// advance_to before, as the object has already been moved out of it; otherwise of the state
// reached.
struct CollisionReport {
  std::size_t object = 0;  // in the scene
  std::string name = {};
  collision::ObjectCollision collision = {};  // points: the first SimConfig::max_points
  bool truncated = false;                     // there were more points
  std::optional<collision::Response> response =
      std::nullopt;  // Reaction::bounce in contact: the first move out
  CollisionDetails details =
      {};  // what the scene asks for; proximity and first contact always of the state reached
};

struct SimulationCounters {
  std::uint64_t steps = 0;
  std::uint64_t contacts = 0;  // of bouncing objects with the hull, by query
  std::uint64_t unrecovered =
      0;  // of those, where no way out was found: reference_inside, no_exit_within_reach
  std::uint64_t still_colliding = 0;    // of those, after kMaxRecoveries moves
  std::uint64_t respawned = 0;          // objects that left the scene, or whose pose was not finite
  std::uint64_t backward_stamps = 0;    // advance_to a time before the present one
  double skipped_s = 0;                 // not simulated: gaps longer than kMaxCatchUp_s
  collision::DetectorCounts detection;  // summed over all queries
};

// Needs a current OpenGL context for construction, use and destruction where collisions are found
// the paper's way, or by backend gl. Deterministic: the same calls give the same bits.
class Simulation {
 public:
  // Real objects are expected in this box (Rig::volume_m); a scene that asks for history needs it.
  // Throws std::invalid_argument where something is out of range.
  Simulation(const config::Scene& scene, const config::SimConfig& config,
             const Eigen::AlignedBox3d& real_volume_world_m = {});

  // Substeps of config.step_s up to time_s [s, any epoch], at most kMaxCatchUp_s of them, against
  // the hull of this frame set; then reports. The first call only sets the clock. No silhouettes:
  // no hull. A time a little back changes nothing; one that lies back by more than kMaxCatchUp_s (a
  // recording that started over) sets the clock. Silhouettes must stay until the next call with
  // others. Throws std::invalid_argument where the time is not finite.
  void advance_to(double time_s, std::span<const hull::Silhouette> silhouettes);
  // The same where no new set has come: the last hull is held.
  void advance_to(double time_s);

  // Paused, advance_to moves the clock and reports, and nothing moves; the pause is not caught up
  // afterwards.
  void pause() { paused_ = true; }
  void resume() { paused_ = false; }
  bool paused() const { return paused_; }
  void reset();  // every object to its start, at rest; clock, pause and counters go on

  double time_s() const { return anchor_s_ + double(steps_since_anchor_) * config_.step_s; }
  std::vector<ObjectState> states() const;  // all objects, in the scene's order
  const std::vector<CollisionReport>& collisions() const {
    return reports_;
  }  // those that react, in the scene's order
  const std::vector<collision::TrackedComponent>* hull_components() const {
    return history_ ? &history_->parts() : nullptr;
  }  // where the scene asks for history
  const SimulationCounters& counters() const { return counters_; }

 private:
  void set_hull(double time_s, std::span<const hull::Silhouette> silhouettes);
  void anchor_at(double time_s);
  void catch_up(double time_s);
  void step();
  void bounce_off_hull();
  collision::Response recover(std::size_t object, collision::ObjectCollision collision);
  collision::Requery requery_of(const collision::DetectionObject& object);
  void add_details(CollisionReport& report, const collision::ObjectCollision& collision,
                   const collision::DetectionObject& object);
  void add_proximity();
  void add_first_contacts();
  collision::HullProximity& proximity_to(double cap_m, double tolerance_m);
  void respawn_lost_objects();
  void report();
  std::span<collision::ObjectCollision> detected(std::span<const std::size_t> objects);
  collision::DetectionObject detection_object(std::size_t object) const;
  bool bounces(std::size_t object) const;

  config::Scene scene_;
  config::SimConfig config_;
  RigidBodies bodies_;
  base::WorkerPool pool_;
  hull::CpuHull hull_{pool_};  // where there is no history, which has the hulls otherwise
  std::optional<hull::HullQuery> own_query_;
  std::optional<HullHistory> history_;
  const hull::HullQuery* query_ =
      nullptr;  // of the hull at hand; none before the first, or where nothing asks for it
  struct SharedProximity {
    double cap_m, tolerance_m;
    std::unique_ptr<collision::HullProximity> proximity;
  };
  std::vector<SharedProximity> proximities_;   // to the hull at hand, for all who ask with these
  std::vector<std::optional<Warmth>> warmth_;  // by object
  std::uint64_t steps_warmed_ = 0;
  std::vector<std::optional<Eigen::Isometry3d>>
      world_from_objects_before_;  // by object, at the frame before; none: it was elsewhere, or
                                   // there was none
  bool is_new_hull_ = false;       // since the last report
  std::unique_ptr<collision::CollisionDetector> detector_;
  std::vector<collision::Bvh> meshes_;  // by object
  std::vector<double> radii_m_;  // by object: of the smallest ball round its centre and its mesh
  std::vector<double>
      flatness_m_;  // by object: how far its triangles lie under the surface that they stand for
  std::vector<std::size_t> reacting_, bouncing_;  // objects
  Eigen::AlignedBox3d scene_bounds_m_;            // objects outside are put back
  std::uint64_t steps_per_query_, steps_since_query_ = 0;
  double anchor_s_ = 0;
  std::uint64_t steps_since_anchor_ = 0;
  bool started_ = false, paused_ = false;
  std::vector<CollisionReport> reports_;
  struct LastContact {
    CollisionReport report;  // collision free where there was none since the last report
    collision::DetectionObject object{};  // as it was then
  };
  std::vector<LastContact> contacts_;  // by object of bouncing_
  SimulationCounters counters_;
};

// What is not simulated within one call of advance_to is skipped: a slow machine must not fall
// behind ever farther.
inline constexpr double kMaxCatchUp_s = 0.25;
// Bouncing objects are queried this often: at 3 m/s a ball moves 2.5 cm in between, less than a
// hand is thick.
inline constexpr double kHullQueryPeriod_s = 1.0 / 120;
// Moves out of the hull at one query: an object that lies in several places of contact leaves one
// after the other.
inline constexpr int kMaxRecoveries = 4;
// A dynamic object this far outside the box of the scene's start is put back to its own.
inline constexpr double kLost_m = 3.0;

}  // namespace fivepipe::sim
