// Baseline: collision of triangle meshes by the Flexible Collision Library, with the polygonised
// hull. Source: Pan, Chitta, Manocha, "FCL: A General Purpose Library for Collision and Proximity
// Queries", ICRA 2012. Available if the library is installed (FIVEPIPE_FCL).
#pragma once
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "common/collision/detection/detection.h"
#include "common/geometry/mesh.h"

namespace fivepipe::baselines {

// Optimised for a fair comparison: it uses the tree and the split rule with the smallest total time
// here (axis-aligned boxes, split at the center: built in a third of the time of oriented boxes),
// keeps everything in the world frame, and calls the traversal directly, because fcl::collide()
// copies both trees in every call.
class HullFcl {
 public:
  HullFcl();
  ~HullFcl();

  std::size_t add(const geometry::Mesh& mesh_world_m);  // builds its tree; returns its number
  // Updates the tree of an object that has moved or deformed.
  void refit(std::size_t object, std::span<const Eigen::Vector3d> vertices_world_m);
  void set_hull(const geometry::Mesh& hull_world_m);  // builds its tree

  // Returns the object's triangles that intersect triangles of the hull's surface, and for each
  // pair the midpoint of their intersection. (FCL's own contact points are the corners deepest
  // behind the other triangle's plane, often far from the contact.) A triangle wholly inside the
  // hull intersects no surface, so the result also has the triangles with a corner for which
  // `in_volume` is true, and that corner. Different objects may be queried concurrently.
  collision::ObjectCollision query(
      std::size_t object,
      const std::function<bool(const Eigen::Vector3d& p_world_m)>& in_volume) const;

 private:
  struct Models;
  std::unique_ptr<Models> models_;
};

}  // namespace fivepipe::baselines
