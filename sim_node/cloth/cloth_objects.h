// The scene's cloths: their motion, and their contact with the hull.
//
// A frame of the maps may move the hull by several centimetres at once. Without a history, the
// steps that follow a new hull divide the way out of it evenly, so that the cloth moves at the
// hull's speed, and at most kMaxClothProjections projections after the last step move the rest of
// the cloth out. With a history, the hull's parts move from step to step, and the projections
// follow each step.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "common/config/scene.h"
#include "sim_node/cloth/cloth.h"
#include "sim_node/cloth/cloth_contact.h"
#include "sim_node/cloth/cloth_object_contact.h"
#include "sim_node/cloth/cloth_self_contact.h"
#include "sim_node/hull/hull_contacts.h"

namespace fivepipe::sim {

// Totals since construction.
struct ClothCounters {
  std::uint64_t contacts = 0;         // one per cloth and step that finds a contact
  std::uint64_t unrecovered = 0;      // collision points without an exit
  std::uint64_t still_colliding = 0;  // one per cloth and projection that ends in the hull
  std::uint64_t self_contacts = 0;    // pairs of a vertex and a triangle, in each step
  std::uint64_t object_contacts = 0;  // pairs of a vertex and an object, in each step
  std::uint64_t reset = 0;            // cloths with a vertex that was not finite or left the scene
};

class ClothObjects {
 public:
  // Throws std::invalid_argument if a cloth's mesh or pins are invalid: see cloth_model().
  // Borrows `rigid`, which must outlive this object and not be null if a cloth has
  // object_collision.
  explicit ClothObjects(const config::Scene& scene, const MovingObjects* rigid = nullptr);

  // Advances all cloths by step_s > 0. Call after the rigid objects' step. steps_left: the steps up
  // to the time of the next report, at least 1, this one included. before_s: time from the step's
  // end to the hull's newest frame; negative after it.
  void step(double step_s, std::uint64_t steps_left, CurrentHull& hull, double before_s);
  void reset();  // returns to the start, at rest

  // Indices in the scene, ascending.
  const std::vector<std::size_t>& objects() const { return objects_; }
  // By position in objects(); in the frame of the object's start [m].
  std::vector<Eigen::Vector3d> vertices_object_m(std::size_t i) const;
  const Cloth& cloth(std::size_t i) const { return cloths_[i].cloth; }
  // At the time of the last report: the pairs of a triangle and a part of the hull in contact in
  // the last step, and the way out of the hull that the last projection left, along the direction
  // in which the cloth leaves. After kMaxClothProjections projections, that before the last one.
  const HullContacts& hull_contacts(std::size_t i) const { return cloths_[i].hull_contacts; }
  const ClothCounters& counters() const { return counters_; }

 private:
  struct OneCloth {
    Cloth cloth;
    ClothHullContact contact;
    std::optional<ClothSelfContact> self_contact;      // present if the scene requests it
    std::optional<ClothObjectContact> object_contact;  // present if the scene requests it
    Eigen::Isometry3d object_from_world;
    Eigen::AlignedBox3d bounds_world_m;  // of the start, kLostCloth_m larger
    double free_fall_m_s;                // speed after a fall by the cloth's size
    bool leaves_hull;
    // Speed of the hull: with a history, that of its parts at the contacts; else estimated from the
    // cloth's depth in it.
    double hull_speed_m_s = 0;
    HullContacts hull_contacts = {};
  };
  void step(OneCloth& one, double step_s, std::uint64_t steps_left, CurrentHull& hull,
            double before_s);
  void project(OneCloth& one, CurrentHull& hull, double step_s, double before_s);
  static void reset(OneCloth& one);

  Eigen::Vector3d gravity_world_m_s2_;
  std::vector<std::size_t> objects_;
  std::vector<OneCloth> cloths_;
  ClothCounters counters_;
};

// A cloth with a vertex this far outside the box of its start returns to it.
inline constexpr double kLostCloth_m = 3.0;
// A cloth that is at most this deep in the hull has left it: a tenth of the maps' pixels at the
// working distance.
inline constexpr double kClothIndifferent_m = 0.3e-3;
inline constexpr int kMaxClothProjections = 16;

}  // namespace fivepipe::sim
