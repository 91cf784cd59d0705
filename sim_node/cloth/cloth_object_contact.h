// Contact of a cloth's vertices with the scene's rigid objects, which it does not move. A triangle
// may pass through an edge of an object between its vertices.
#pragma once
#include <vector>

#include "sim_node/cloth/cloth.h"
#include "sim_node/objects/moving_objects.h"

namespace fivepipe::sim {

class ClothObjectContact {
 public:
  // Borrows `objects`, which must outlive this object. The cloth is at its start.
  ClothObjectContact(const Cloth& cloth, const MovingObjects& objects, double thickness_m);

  // Moves the vertices that objects have met in the step out of them. Call after the cloth's step
  // of step_s. Returns the number of contacts.
  std::uint64_t separate(Cloth& cloth, double step_s);
  void reset(const Cloth& cloth);  // the cloth has jumped

 private:
  const MovingObjects& objects_;
  double thickness_m_;
  // By vertex: the place at the end of the last separate(). A path that begins there keeps the side
  // of the object on which the vertex is, also if the hull has pushed the vertex into the object
  // since.
  std::vector<Eigen::Vector3d> free_world_m_;
};

}  // namespace fivepipe::sim
