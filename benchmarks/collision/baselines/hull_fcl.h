// Rival: triangle meshes against one another by the Flexible Collision Library, as one would do who
// has polygons of the hull. Source: Pan, Chitta, Manocha, "FCL: A General Purpose Library for
// Collision and Proximity Queries", ICRA 2012. Only where it is installed (FIVEPIPE_FCL).
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "common/collision/detection/detection.h"
#include "common/geometry/mesh.h"

namespace fivepipe::baselines {

// Done to be fair: of FCL's trees and ways to split them those that are quickest all in all here
// (boxes along the axes, split in their middle: built in a third of the time of oriented ones),
// everything in the world's frame and straight to the traversal, past fcl::collide(), which copies
// both trees at every call.
class HullFcl {
 public:
  HullFcl();
  ~HullFcl();

  std::size_t add(const geometry::Mesh& mesh_world_m);  // its tree is built; the object's number
  void refit(std::size_t object,
             std::span<const Eigen::Vector3d> vertices_world_m);  // the mesh has deformed, or moved
  void set_hull(const geometry::Mesh& hull_world_m);              // its tree is built

  // Which of the object's triangles meet triangles of the hull's surface, and for each such pair a
  // point: the middle of what they share (FCL's own contact points are the corners that lie deepest
  // behind the other's plane, often far from the contact). A triangle, or object, wholly inside the
  // hull meets none and is called free: surfaces have no inside. Different objects may be asked at
  // the same time.
  collision::ObjectCollision query(std::size_t object) const;

 private:
  struct Models;
  std::unique_ptr<Models> models_;
};

}  // namespace fivepipe::baselines
