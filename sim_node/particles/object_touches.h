// Contact of particles with the scene's objects. Particles have no mass: they do not move objects.
#pragma once
#include <vector>

#include "sim_node/cloth/cloth_objects.h"
#include "sim_node/objects/object_models.h"
#include "sim_node/objects/rigid_bodies.h"
#include "sim_node/particles/particle_set.h"

namespace fivepipe::sim {

class ObjectTouches {
 public:
  // Borrows its arguments, which must outlive this object. cloths: null if the scene has none.
  ObjectTouches(const config::Scene& scene, const ObjectModels& models, const RigidBodies& bodies,
                const ClothObjects* cloths);

  // Call after the objects' step and before step(): takes the objects' new poses. The poses of the
  // previous call are those at the start of the step.
  void begin();
  // Moves the particles out of the objects.
  void step(const config::ParticleSource& source, ParticleSet& particles) const;
  // Call if the object jumped: the next begin() also takes its new pose as that at the start of the
  // step.
  void forget(std::size_t object) { is_known_[object] = false; }
  void reset();  // all have jumped

 private:
  struct ClothTree {
    std::size_t object, position;  // in the scene, and in cloths_
    collision::Bvh tree;           // world frame
    std::vector<Eigen::Vector3d> before_world_m;
    double moved_m = 0;  // the longest move of a vertex in the step
  };
  // Returns the box of an object at the start and at the end of the step.
  Eigen::AlignedBox3d swept_world_m(std::size_t object) const;
  void touch_rigid(std::size_t object, const config::ParticleSource& source,
                   ParticleSet& particles) const;
  void touch_cloth(const ClothTree& cloth, const config::ParticleSource& source,
                   ParticleSet& particles) const;

  const config::Scene& scene_;
  const ObjectModels& models_;
  const RigidBodies& bodies_;
  const ClothObjects* cloths_;
  std::vector<Eigen::AlignedBox3d> bounds_m_;  // by object, in its frame
  std::vector<bool> is_known_;                 // by object: the last begin() took its pose
  std::vector<Eigen::Isometry3d> world_from_before_, world_from_now_;  // by object
  std::vector<ClothTree> cloth_trees_;
};

}  // namespace fivepipe::sim
