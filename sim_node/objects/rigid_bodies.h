// Rigid-body dynamics of the scene's objects: gravity and contacts among objects, without the hull.
// Uses Bullet in double precision and one thread, so the same calls give the same bits.
#pragma once
#include <memory>

#include "common/config/scene.h"

namespace fivepipe::sim {

// Identifies objects by their index in scene.objects. Boxes and spheres are exact. A fixed mesh or
// curtain is represented by its triangles, a dynamic one by its convex hull; both are 1 mm thicker.
// A contact has the dynamic object's restitution, or the product of both. A cloth takes no part and
// keeps its start pose.
class RigidBodies {
 public:
  explicit RigidBodies(const config::Scene& scene);
  ~RigidBodies();
  RigidBodies& operator=(RigidBodies&&) noexcept;

  void step(double step_s);  // > 0; one step of the whole scene

  Eigen::Isometry3d world_from_object(std::size_t object) const;
  // Centre of mass: the centre of the object's bounding box in its own frame.
  Eigen::Vector3d center_world_m(std::size_t object) const;
  Eigen::Vector3d velocity_m_s(std::size_t object) const;  // of the centre, world frame

  // The functions below require a dynamic object.
  void set_velocity_m_s(std::size_t object, const Eigen::Vector3d& velocity_world_m_s);
  void translate(std::size_t object, const Eigen::Vector3d& move_world_m);
  void respawn(std::size_t object);  // moves it to its start pose, at rest

 private:
  struct World;
  std::unique_ptr<World> world_;
};

}  // namespace fivepipe::sim
