// Contact of bouncing objects with the hull: detects it between steps and moves the objects out
// (paper, section 4.4).
#pragma once
#include <optional>
#include <vector>

#include "common/config/deployment.h"
#include "sim_node/hull/current_hull.h"
#include "sim_node/hull/hull_contacts.h"
#include "sim_node/objects/object_models.h"
#include "sim_node/objects/rigid_bodies.h"

namespace fivepipe::sim {

// A contact as it was before the object was moved out of the hull.
struct HullContact {
  collision::ObjectCollision collision;
  collision::DetectionObject object;
  collision::Response response;  // of the first move
};

class RigidContact {
 public:
  struct Counters {
    std::uint64_t contacts = 0;         // one per object and query that finds a contact
    std::uint64_t unrecovered = 0;      // contacts without an exit
    std::uint64_t still_colliding = 0;  // contacts that remain after kMaxRecoveries moves
  };

  // Borrows its arguments, which must outlive this object.
  RigidContact(const config::Scene& scene, const config::SimConfig& config,
               const ObjectModels& models, RigidBodies& bodies, CurrentHull& hull);

  // Call after_step() after each step. It queries the hull every kHullQueryPeriod_s and bounces the
  // objects.
  void after_step();
  // Restarts the query period and forgets the last query.
  void reset();

  // Returns the object's last contact since the previous call and forgets it; nullopt if there was
  // none.
  std::optional<HullContact> take_contact(std::size_t object);
  // Of the last query: the number of objects that collided, and the largest depth that the moves
  // left, along V_rec. An object without an exit counts without depth.
  const HullContacts& last_query() const { return last_query_; }
  const Counters& counters() const { return counters_; }

 private:
  void bounce_off_hull();
  collision::Response recover(std::size_t object, const collision::ObjectCollision& collision);
  collision::Response move_out(std::size_t object, const collision::ObjectCollision& collision);

  const config::Scene& scene_;
  const ObjectModels& models_;
  RigidBodies& bodies_;
  CurrentHull& hull_;
  int window_px_;
  double resting_speed_m_s_;
  std::uint64_t steps_per_query_, steps_since_query_ = 0;
  std::vector<std::optional<HullContact>> contacts_;  // by object
  HullContacts last_query_;
  Counters counters_;
};

// Returns the object at its present pose, with RP_obj at its centre.
collision::DetectionObject detection_object(const ObjectModels& models, const RigidBodies& bodies,
                                            std::size_t object);

// Time between hull queries. At 3 m/s a ball moves 2.5 cm in this time, less than the thickness of
// a hand.
inline constexpr double kHullQueryPeriod_s = 1.0 / 120;
// Maximum number of moves per query. An object with several contacts leaves one contact per move.
inline constexpr int kMaxRecoveries = 4;

}  // namespace fivepipe::sim
