// Rival: triangle meshes against one another by the Flexible Collision Library, as one would do who has polygons of the hull.
// Source: Pan, Chitta, Manocha, "FCL: A General Purpose Library for Collision and Proximity Queries", ICRA 2012. Only where it is installed (FIVEPIPE_FCL).
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "common/collision/collision.h"
#include "common/geometry/mesh.h"

namespace fivepipe::rivals {

// Trees of oriented boxes: those that were quickest here.
class HullFcl {
 public:
  HullFcl();
  ~HullFcl();

  std::size_t add(const Mesh& mesh);                                                       // its tree is built; the object's number
  void refit(std::size_t object, std::span<const Eigen::Vector3d> vertices_m);             // the mesh has deformed
  void set_hull(const Mesh& hull_world_m);                                                 // its tree is built

  // Which of the object's triangles meet triangles of the hull's surface, and for each such pair a point: the middle of what they share (FCL's own
  // contact points are the corners that lie deepest behind the other's plane, often far from the contact). A triangle, or object, wholly
  // inside the hull meets none and is called free: surfaces have no inside. Different objects may be asked at the same time.
  ObjectCollision query(std::size_t object, const Eigen::Isometry3d& world_from_mesh) const;

 private:
  struct Models;
  std::unique_ptr<Models> models_;
};

}  // namespace fivepipe::rivals
