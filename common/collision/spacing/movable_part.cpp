#include "common/collision/spacing/movable_part.h"

#include <stdexcept>

namespace fivepipe::collision {
namespace {

geometry::Mesh moved(geometry::Mesh mesh, const Eigen::Isometry3d& world_from_part) {
  for (Eigen::Vector3d& vertex_m : mesh.vertices_m) vertex_m = world_from_part * vertex_m;
  return mesh;
}

Eigen::Vector3d unit(const Eigen::Vector3d& axis_world) {
  const Eigen::Vector3d direction = axis_world.stableNormalized();
  if (!axis_world.allFinite() || std::abs(direction.norm() - 1) > 1e-9)
    throw std::invalid_argument("movable part: the axis has no direction");
  return direction;
}

}  // namespace

MovablePart::MovablePart(geometry::Mesh mesh, const Eigen::Isometry3d& world_from_part,
                         const Eigen::Vector3d& axis_world)
    : axis_world_(unit(axis_world)),
      tree_(std::make_shared<const Bvh>(moved(std::move(mesh), world_from_part))) {}

MovablePart MovablePart::beside(const Eigen::Vector3d& offset_world_m,
                                const Eigen::Vector3d& axis_world) const {
  if (!offset_world_m.allFinite())
    throw std::invalid_argument("movable part: the offset is not finite");
  MovablePart other = *this;
  other.offset_world_m_ += offset_world_m;
  other.axis_world_ = unit(axis_world);
  return other;
}

}  // namespace fivepipe::collision
