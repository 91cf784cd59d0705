// The scene's objects as rigid bodies under gravity, in contact with each other; no hull. Bullet
// does the work, in double and in one thread: the same calls give the same bits.
#pragma once
#include <memory>

#include "common/config/scene.h"

namespace fivepipe::sim {

// Objects by their index in scene.objects. Boxes and spheres are exact; a fixed mesh or curtain is
// its triangles, a dynamic one its convex hull, both 1 mm thicker. Restitution is that of the
// dynamic object (between two: the product). Velocities are those of the centre.
class RigidBodies {
 public:
  explicit RigidBodies(const config::Scene& scene);
  ~RigidBodies();
  RigidBodies(RigidBodies&&) noexcept;
  RigidBodies& operator=(RigidBodies&&) noexcept;

  void step(double step_s);  // > 0; one step of the whole scene

  Eigen::Isometry3d world_from_object(std::size_t object) const;
  Eigen::Vector3d center_world_m(
      std::size_t object) const;  // of the object's box in its own frame; its centre of mass
  Eigen::Vector3d velocity_m_s(std::size_t object) const;

  // Dynamic objects only.
  void set_velocity_m_s(std::size_t object, const Eigen::Vector3d& velocity_world_m_s);
  void translate(std::size_t object, const Eigen::Vector3d& move_world_m);
  void respawn(std::size_t object);  // to its start, at rest

 private:
  struct World;
  std::unique_ptr<World> world_;
};

}  // namespace fivepipe::sim
