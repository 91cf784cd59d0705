// A rigid part that can be moved along an axis, and its spacing: how far it has been moved.
#pragma once
#include <memory>

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

  // The same part on another line: at spacing 0 it is moved by offset_world_m from where this part
  // is at spacing 0, and it moves along axis_world. Both share one tree. Throws
  // std::invalid_argument if an argument is not finite, or the axis has no direction.
  MovablePart beside(const Eigen::Vector3d& offset_world_m,
                     const Eigen::Vector3d& axis_world) const;

  // The part's triangles in the world, without a move.
  const Bvh& tree() const { return *tree_; }
  const Eigen::Vector3d& axis_world() const { return axis_world_; }  // unit
  // The move of tree() at a spacing [m, world].
  Eigen::Vector3d move_world_m(double spacing_m) const {
    return offset_world_m_ + spacing_m * axis_world_;
  }
  // Pose of tree() at a spacing.
  Eigen::Isometry3d pose(double spacing_m) const {
    return Eigen::Isometry3d(Eigen::Translation3d(move_world_m(spacing_m)));
  }

 private:
  Eigen::Vector3d axis_world_;
  Eigen::Vector3d offset_world_m_ = Eigen::Vector3d::Zero();
  std::shared_ptr<const Bvh> tree_;
};

}  // namespace fivepipe::collision
