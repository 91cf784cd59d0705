// Rigid contact with the hull: the certified collisions of the objects with `reaction: contact`
// become constraints of the rigid-body solver in every step.
//
//   detection   At the start of a step, each object is placed relative to each part of the hull at
//               the newest frame, where the hull is known (hull_part.h), and detected there.
//   impact      An object that a part reaches within a step is moved back along their relative
//               motion to where it first touches. The contact is computed there, so that its normal
//               does not depend on how far the step went in; the object is then moved out.
//   contact     The contact's planes are measured (contact_probe.h) and join those that the object
//               keeps (kept_contacts.h).
//   constraint  Bullet solves the contacts together with those among the objects, with friction and
//               restitution relative to the part's velocity.
#pragma once
#include <vector>

#include "common/config/deployment.h"
#include "sim_node/contact/contact_probe.h"
#include "sim_node/hull/current_hull.h"
#include "sim_node/hull/hull_contacts.h"
#include "sim_node/objects/object_models.h"
#include "sim_node/objects/rigid_bodies.h"

namespace fivepipe::sim {

class HullManifolds {
 public:
  struct Counters {
    std::uint64_t contacts = 0;     // one per object, part and step with a contact
    std::uint64_t impacts = 0;      // contacts that began within a step
    std::uint64_t unrecovered = 0;  // collisions without a contact, because no exit is within reach
  };

  // Borrows its arguments, which must outlive this object.
  HullManifolds(const config::Scene& scene, const ObjectModels& models, RigidBodies& bodies,
                CurrentHull& hull);

  // Returns the manifolds for the next step of the bodies. Moves bodies that a part of the hull has
  // reached out of it. before_s: time from the step's start to the hull's newest frame; negative
  // after it. The manifolds are valid until the next call.
  std::span<HullManifold> before_step(double step_s, double before_s);
  // Call after the step with the manifolds: keeps the solver's impulses.
  void after_step();

  void forget(std::size_t object);  // it has jumped
  void reset();                     // all have jumped

  // Returns the number of pairs of an object and a part with kept contacts, and the depth of the
  // deepest point below its plane, at before_s before the hull's newest frame. A plane is within
  // 1.5 footprints of the hull's surface (kPlaneTolerance); between the points an object may be
  // deeper in the hull.
  HullContacts contacts(double before_s) const;
  const Counters& counters() const { return counters_; }

 private:
  // An object and a part in a step.
  struct Meeting;
  // When and how an object first touches a part within a step.
  struct Touch {
    double back_s = 0;  // before the step's start
    collision::ObjectCollision collision = {};
  };
  // An object's pose relative to a part at the last detection of both, in the newest frame's hull.
  struct Detected {
    std::uint64_t part;
    Eigen::Isometry3d world_from_object;
  };

  void follow_new_hull();
  bool is_near(const Meeting& meeting, double step_s) const;
  bool has_contact(const Meeting& meeting) const;
  // Whether object and part touch, and have not moved since their last detection.
  bool is_still(const Meeting& meeting) const;
  HullPart local(std::size_t object, HullPart part) const;
  void meet(std::size_t object, double step_s, double before_s);
  Meeting meeting_with(std::size_t object, const HullPart& part, double before_s) const;
  void touch(const Meeting& meeting, double step_s);
  std::vector<KeptContact> kept_with(const Meeting& meeting) const;
  collision::ObjectCollision detect_before(const Meeting& meeting, double back_s);
  Touch first_touch(const Meeting& meeting, double step_s, bool is_new);
  static void begin_at_touch(std::vector<KeptContact>& measured, const Eigen::Isometry3d& at_touch);
  void move_out(const Meeting& meeting, double fraction);
  void add_manifold(const Meeting& meeting);

  const config::Scene& scene_;
  const ObjectModels& models_;
  RigidBodies& bodies_;
  CurrentHull& hull_;
  std::uint64_t frame_ = 0;
  double frame_time_s_ = 0;
  std::vector<std::vector<KeptContact>> kept_;  // by object
  // By object, in the newest frame: all, and those that continue the motion of the frame before.
  std::vector<std::vector<SurfaceMotion>> seen_motions_, surface_motions_;
  std::vector<std::vector<Detected>> detected_;  // by object
  std::vector<Eigen::Vector3d> lift_m_;          // by object: moves out in the current step
  ContactProbe probe_;
  std::vector<HullManifold> manifolds_;
  std::vector<std::vector<std::size_t>> kept_of_manifold_;  // indices of the points in kept_
  Counters counters_;
};

// Fraction of a penetration that a step removes, as a move without velocity: after the 8 steps of a
// frame at 30 Hz, 0.4 % of a penetration remain.
inline constexpr double kHullCorrection = 0.5;
// An object that moves further per step relative to a part is detected on its way too, at this
// distance: thinner than a finger.
inline constexpr double kSweep_m = 0.004;
// Maximum number of detections on an object's way per step: enough for 60 m/s at 240 steps per
// second.
inline constexpr int kMaxSweeps = 64;

}  // namespace fivepipe::sim
