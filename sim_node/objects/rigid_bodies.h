// Rigid-body dynamics of the scene's objects: gravity, contacts among objects, and the given
// contacts with the hull. Uses Bullet in double precision and one thread, so the same calls give
// the same bits.
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "common/config/scene.h"
#include "sim_node/objects/joint_motion.h"
#include "sim_node/objects/rigid_velocity.h"

namespace fivepipe::sim {

// A point at which an object touches the hull: a constraint of one step.
struct HullContactPoint {
  Eigen::Vector3d on_object_world_m, normal_world;  // the normal is unit and leaves the hull
  // Of the point from the hull's surface along the normal. A penetration (negative) is not
  // corrected but counts as a touch, because Bullet would correct it by a velocity.
  double distance_m;
  // Ratio of the speeds after and before; only an approach faster than kMinBounce_m_s bounces.
  double restitution;
  // Normal impulse of the previous step, with which the solver starts; step() replaces it.
  double impulse_n_s = 0;
};

// The contacts of one object with one part of the hull.
struct HullManifold {
  std::size_t object;                         // must be dynamic
  RigidVelocity velocity;                     // of the hull's surface
  std::vector<HullContactPoint> points = {};  // at most kMaxHullContacts
};
// Bullet solves at most 4 points between two bodies.
inline constexpr std::size_t kMaxHullContacts = 4;
// A slower approach ends at rest. Gravity adds half of it per step of 1/100 s.
inline constexpr double kMinBounce_m_s = 0.2;

// Contacts between objects after the last step.
struct BodyContacts {
  // Pairs of objects, at least one of them dynamic, that overlap or that the last step pushed
  // apart.
  std::size_t pairs = 0;
  // The deepest overlap [m], at the points that the last step's detection found, with the present
  // poses. Meshes are 1 mm thicker: up to 2 mm more than their triangles overlap. An overlap that
  // began within the step is not found.
  double deepest_m = 0;
};

// Identifies objects by their index in scene.objects. Boxes and spheres are exact. A fixed mesh or
// curtain is represented by its triangles, a dynamic one by its convex hull; both are 1 mm thicker.
// A contact has the dynamic object's restitution, or the product of both. A cloth takes no part and
// keeps its start pose.
class RigidBodies {
 public:
  explicit RigidBodies(const config::Scene& scene);
  ~RigidBodies();
  RigidBodies& operator=(RigidBodies&&) noexcept;

  // One step of the whole scene; step_s > 0. Sets the impulses of the manifolds' points.
  void step(double step_s, std::span<HullManifold> manifolds = {});

  Eigen::Isometry3d world_from_object(std::size_t object) const;
  // Centre of mass: the centre of the object's bounding box in its own frame.
  Eigen::Vector3d center_world_m(std::size_t object) const;
  Eigen::Vector3d velocity_m_s(std::size_t object) const;  // of the centre, world frame
  Eigen::Vector3d velocity_m_s(std::size_t object, const Eigen::Vector3d& p_world_m) const;

  // Returns the kinetic energy of translation and rotation [J]; 0 if the object is not dynamic.
  double kinetic_energy_j(std::size_t object) const;
  BodyContacts contacts() const;
  // Returns the depth by which the shapes of two objects overlap [m], without the thickness of
  // meshes; 0 if they do not.
  double overlap_m(std::size_t a, std::size_t b) const;

  // The functions below require a dynamic object; translate() and respawn() also take a fixed one.
  void set_velocity_m_s(std::size_t object, const Eigen::Vector3d& velocity_world_m_s);
  void translate(std::size_t object, const Eigen::Vector3d& move_world_m);
  // Moves the object, without velocity, so that its point p moves by this; as far as its joint
  // allows. Returns the point's move.
  Eigen::Vector3d move_out(std::size_t object, const Eigen::Vector3d& p_world_m,
                           const Eigen::Vector3d& move_world_m);
  void respawn(std::size_t object);  // moves it to its start pose, with its start velocity

 private:
  struct World;
  std::unique_ptr<World> world_;
};

}  // namespace fivepipe::sim
