// Contact of particles with the scene's objects. Particles have no mass: they do not move objects.
#pragma once
#include <vector>

#include "sim_node/cloth/cloth_objects.h"
#include "sim_node/objects/moving_objects.h"
#include "sim_node/particles/particle_set.h"

namespace fivepipe::sim {

class ParticleObjectContact {
 public:
  // Borrows its arguments, which must outlive this object. cloths: null if the scene has none.
  ParticleObjectContact(const ObjectModels& models, const MovingObjects& rigid,
                        const ClothObjects* cloths);

  // Call after the objects' step and before step(): takes the cloths' new shapes. The shapes of
  // the previous call are those at the start of the step.
  void begin();
  // Moves the particles out of the objects.
  void step(const config::ParticleSource& source, ParticleSet& particles) const;
  // Call if the cloth jumped: the next begin() also takes its new shape as that at the start of the
  // step.
  void forget(std::size_t object);
  void reset();  // all have jumped

 private:
  struct ClothTree {
    std::size_t object, position;  // in the scene, and in cloths_
    collision::Bvh tree;           // world frame
    bool is_known = false;         // the tree has the shape of the step before
    std::vector<Eigen::Vector3d> before_world_m = {};
    double moved_m = 0;  // the longest move of a vertex in the step
  };
  void leave(const MovingObjects::Swept& object, const config::ParticleSource& source,
             ParticleSet& particles) const;
  void leave(const ClothTree& cloth, const config::ParticleSource& source,
             ParticleSet& particles) const;

  const MovingObjects& rigid_;
  const ClothObjects* cloths_;
  std::vector<ClothTree> cloth_trees_;
};

}  // namespace fivepipe::sim
