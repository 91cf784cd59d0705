// Simulation of the virtual objects: gravity, contact with each other and with the visual hull
// (paper, section 4).
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "common/config/deployment.h"
#include "sim_node/cloth/cloth_objects.h"
#include "sim_node/contact/hull_manifolds.h"
#include "sim_node/particles/particles.h"
#include "sim_node/simulation/collision_reports.h"
#include "sim_node/simulation/simulation_clock.h"
#include "sim_node/simulation/simulation_metrics.h"

namespace fivepipe::sim {

struct ObjectState {
  std::string name;
  Eigen::Isometry3d world_from_object = Eigen::Isometry3d::Identity();
  Eigen::Vector3d velocity_world_m_s = Eigen::Vector3d::Zero();
  // Object frame; empty for a rigid object, which keeps its mesh.
  std::vector<Eigen::Vector3d> vertices_m;
  std::vector<float> warmth;  // per vertex; empty if the scene does not warm the object
};

// Totals since construction.
struct SimulationCounters {
  std::uint64_t steps = 0;
  // Objects with reaction `bounce`: see RigidContact::Counters. The first two also count those with
  // reaction `contact`: see HullManifolds::Counters.
  std::uint64_t contacts = 0;
  std::uint64_t unrecovered = 0;
  std::uint64_t still_colliding = 0;
  std::uint64_t impacts = 0;    // see HullManifolds::Counters
  std::uint64_t respawned = 0;  // objects that left the scene or had a non-finite pose
  ClothCounters cloth;
  ParticleCounters particles;
  std::uint64_t backward_stamps = 0;  // see SimulationClock::Counters for these two
  double skipped_s = 0;
  collision::DetectorCounts detection;  // summed over all queries
};

// Needs a current OpenGL context for construction, use and destruction if config.collision is gl or
// paper. Deterministic: the same calls give the same bits.
class Simulation {
 public:
  // real_volume_world_m: box that contains all real objects (Rig::volume_m); required if the scene
  // has a history. stop: advance_to() calls it before each step; if it returns true, advance_to()
  // returns without the remaining steps and without reports. Throws std::invalid_argument if an
  // argument is out of range.
  Simulation(
      const config::Scene& scene, const config::SimConfig& config,
      const Eigen::AlignedBox3d& real_volume_world_m = {},
      std::function<bool()> stop = [] { return false; });
  Simulation(const Simulation&) = delete;

  // Simulates up to time_s [s, any epoch] against the hull of this frame set, then makes the
  // reports. SimulationClock::advance_to() defines the number of steps. Without silhouettes there
  // is no hull. outlines: sub-pixel coverage of the silhouettes, or empty; CP_hull and N_hull of
  // the reports then use it. Both must stay valid until the next call that passes silhouettes.
  // Returns false if `stop` ended it. Throws std::invalid_argument if time_s is not finite.
  bool advance_to(double time_s, std::span<const hull::Silhouette> silhouettes,
                  std::span<const hull::CoverageOutline> outlines = {});
  // As above, without a new frame set: uses the last hull.
  bool advance_to(double time_s);

  // While paused, advance_to() sets the clock and makes reports, but no object moves. The pause is
  // not simulated afterwards.
  void pause() { clock_.pause(); }
  void resume() { clock_.resume(); }
  // Moves every object to its start, at rest. Keeps clock, pause, spacings and counters.
  void reset();
  // Moves an object, by its position in the scene, to its pose at this spacing, also while paused.
  // Throws std::invalid_argument if the object has no spacing or its range does not contain it.
  void set_spacing(std::size_t object, double spacing_m);

  double time_s() const { return clock_.time_s(); }
  std::vector<ObjectState> states() const;  // all objects, in the scene's order
  // The particles of a source, by its position in the scene. Valid until the next advance_to() or
  // reset().
  const ParticleSet& particles(std::size_t source) const { return particles_->of_source(source); }
  // One per object with a reaction, in the scene's order; with reaction `contact` only if the scene
  // requests a report.
  const std::vector<CollisionReport>& collisions() const { return reports_; }
  // Returns null if the scene has no history.
  const std::vector<collision::TrackedComponent>* hull_components() const;
  SimulationCounters counters() const;
  // Returns the metrics of the present state.
  SimulationMetrics metrics() const;

 private:
  bool advance(double time_s, bool is_new_hull);
  // steps_left: steps up to the time of advance(), at least 1, this one included.
  void step(std::uint64_t steps_left);
  void step_bodies(std::uint64_t steps_left);
  void step_cloths(std::uint64_t steps_left, double end_before_hull_s);
  // Time from the start of the step to the hull's newest frame; negative after it.
  double before_hull_s(std::uint64_t steps_left) const;
  void refit_cloths();
  void place(std::size_t object);  // at its spacing; the object must have one
  void respawn_lost_objects();
  void report(bool is_new_hull);

  config::Scene scene_;
  config::SimConfig config_;
  ObjectModels models_;
  RigidBodies bodies_;
  CurrentHull hull_;
  SimulationClock clock_;
  RigidContact contact_;
  std::optional<HullManifolds> manifolds_;  // present if the scene has an object in contact
  ProximityFields proximity_;
  std::optional<MovingObjects> moving_;  // present if particles or a cloth meet rigid objects
  std::optional<ClothObjects> cloths_;   // present if the scene has a cloth
  Eigen::AlignedBox3d scene_bounds_m_;   // respawns dynamic objects outside, removes particles
  std::optional<Particles> particles_;   // present if the scene has a source
  std::vector<double> spacings_m_;       // by object; 0: the object has none
  std::uint64_t steps_ = 0, respawned_ = 0;
  std::vector<CollisionReport> reports_;
  std::function<bool()> stop_;
};

// A dynamic object is respawned, and a particle removed, if it is this far outside the box of the
// scene's start.
inline constexpr double kLost_m = 3.0;

}  // namespace fivepipe::sim
