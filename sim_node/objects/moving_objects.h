// Contact of points (particles, the vertices of a cloth) with the scene's rigid objects, which move
// within a step. The points do not move the objects.
#pragma once
#include <optional>
#include <vector>

#include "sim_node/objects/object_models.h"
#include "sim_node/objects/rigid_bodies.h"

namespace fivepipe::sim {

// The tangent plane of a surface that a point is near, at the end of a step.
struct SurfaceContact {
  Eigen::Vector3d normal_world;  // unit, out of the surface
  double distance_m;             // from the plane to the point; negative behind it
  Eigen::Vector3d velocity_world_m_s = Eigen::Vector3d::Zero();  // of the surface
};

class MovingObjects {
 public:
  // Borrows its arguments, which must outlive this object.
  MovingObjects(const config::Scene& scene, const ObjectModels& models, const RigidBodies& bodies);

  // Call after the bodies' step: takes their new poses. The poses of the previous call are those at
  // the start of the step.
  void begin_step();
  // Call if the object jumped: the next begin_step() also takes its new pose as that at the start
  // of the step.
  void forget(std::size_t object) { is_known_[object] = false; }
  void reset() { is_known_.assign(is_known_.size(), false); }  // all have jumped

  // A rigid object in the present step, for points that keep radius_m from it. Valid until the next
  // begin_step().
  class Swept {
   public:
    // Returns where the object stops a point that moves from from_m to to_m in the step [world], or
    // nullopt if the point stays at least the radius away, or if the path is not finite.
    std::optional<SurfaceContact> contact(const Eigen::Vector3d& from_m,
                                          const Eigen::Vector3d& to_m) const;

   private:
    friend class MovingObjects;
    Swept(const MovingObjects& objects, std::size_t object, double radius_m);
    const MovingObjects& objects_;
    std::size_t object_;
    double radius_m_;
    Eigen::AlignedBox3d box_world_m_;  // of the object at both ends of the step, radius_m larger
    Eigen::Isometry3d before_from_world_, now_from_world_;
  };
  // Of all objects but cloths, in the scene's order.
  std::vector<Swept> swept(double radius_m) const;

 private:
  const config::Scene& scene_;
  const ObjectModels& models_;
  const RigidBodies& bodies_;
  std::vector<Eigen::AlignedBox3d> bounds_m_;  // by object, in its frame
  std::vector<bool> is_known_;                 // by object: the last begin_step() took its pose
  std::vector<Eigen::Isometry3d> world_from_before_, world_from_now_;  // by object
};

// Returns true if the bounding box of a point's path in the step overlaps the box.
bool may_meet(const Eigen::AlignedBox3d& box_m, const Eigen::Vector3d& from_m,
              const Eigen::Vector3d& to_m);

}  // namespace fivepipe::sim
