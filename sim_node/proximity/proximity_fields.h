// Distances from the scene's objects to the current hull, and the warmth that follows them.
#pragma once
#include <memory>
#include <optional>
#include <vector>

#include "common/config/scene.h"
#include "sim_node/objects/object_models.h"
#include "sim_node/objects/rigid_bodies.h"
#include "sim_node/proximity/warmth.h"

namespace fivepipe::sim {

class ProximityFields {
 public:
  // Borrows its arguments, which must outlive this object. step_s: one step of the simulation.
  ProximityFields(const config::Scene& scene, const ObjectModels& models, const RigidBodies& bodies,
                  double step_s);

  // Drops all cached cubes, which refer to the hull. Call clear() before the hull changes.
  void clear();

  // Returns one element per vertex or triangle of the object's mesh, as requested.
  std::vector<collision::Proximity> field(const hull::HullQuery& query, std::size_t object,
                                          const config::ProximityRequests& requests);

  // Warms the scene's warmed objects over the steps since the last call. `steps`: total number of
  // steps so far.
  void warm(const hull::HullQuery& query, std::uint64_t steps);
  void reset_warmth();
  // Returns the object's warmth per vertex; empty if the scene does not warm it.
  std::vector<float> warmth(std::size_t object) const;

 private:
  struct SharedProximity {
    double cap_m, tolerance_m;
    std::unique_ptr<collision::HullProximity> proximity;
  };
  collision::HullProximity& proximity_to(const hull::HullQuery& query, double cap_m,
                                         double tolerance_m);

  const config::Scene& scene_;
  const ObjectModels& models_;
  const RigidBodies& bodies_;
  double step_s_;
  std::vector<SharedProximity> shared_;        // one per cap and tolerance: queries share cubes
  std::vector<std::optional<Warmth>> warmth_;  // by object
  std::uint64_t steps_warmed_ = 0;
};

// Returns whether the scene warms any object.
bool warms_objects(const config::Scene& scene);

}  // namespace fivepipe::sim
