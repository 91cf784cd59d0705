// A rigid part that can be moved along an axis, and its spacing: how far it has been moved.
#pragma once
#include "common/collision/detection/bvh.h"
#include "common/geometry/mesh.h"

namespace fivepipe::collision {

class MovablePart {
 public:
  // mesh: in the part's frame [m]. world_from_part: the pose at spacing 0. axis_world: the
  // direction in which a positive spacing moves the part, of any length. Throws
  // std::invalid_argument as Bvh does, and if the pose or the axis is not finite, or the axis has
  // no direction.
  MovablePart(geometry::Mesh mesh, const Eigen::Isometry3d& world_from_part,
              const Eigen::Vector3d& axis_world);

  // The part's triangles at spacing 0, in the world.
  const Bvh& tree() const { return tree_; }
  const Eigen::Vector3d& axis_world() const { return axis_world_; }  // unit
  // Pose of tree() at a spacing.
  Eigen::Isometry3d pose(double spacing_m) const {
    return Eigen::Isometry3d(Eigen::Translation3d(spacing_m * axis_world_));
  }

 private:
  Eigen::Vector3d axis_world_;
  Bvh tree_;
};

}  // namespace fivepipe::collision
