// Contact of a point, which keeps a radius, with a virtual object that moves within a step.
//
// The point's path in the step is a segment in the object's frame: from its place at the start
// relative to the object's pose then, to that at the end relative to the pose at the end. A
// point that crosses a surface within the step is therefore stopped, however fast both are.
#pragma once
#include <Eigen/Core>
#include <optional>

#include "common/collision/detection/bvh.h"

namespace fivepipe::sim {

// In the object's frame.
struct PathInStep {
  Eigen::Vector3d from_m, to_m;
  double radius_m;  // distance that the point keeps
};

// A plane that the point must be at least its radius in front of; object frame.
struct SolidContact {
  Eigen::Vector3d normal;  // unit
  double distance_m;       // from the plane to the end of the path
};

// Each returns the plane that stops the point, or nullopt if the point stays at least its radius
// away or the path is not finite.

// A box around the origin. Its edges count as sharp, also for the point's radius.
std::optional<SolidContact> box_contact(const Eigen::Vector3d& half_m, const PathInStep& path);
// A ball around the origin.
std::optional<SolidContact> ball_contact(double ball_radius_m, const PathInStep& path);

struct MeshContact {
  SolidContact plane;
  std::uint32_t triangle;
  Eigen::Vector3d weights;  // barycentric, of the stopping point
};
// A surface with two sides; the point stays on its side. vertices_before_m: those of the tree at
// the start of the step, if they differ (a cloth); else empty. moved_m: the longest of their moves.
// The first triangle that the path crosses stops the point. If there is none, the point keeps its
// radius from the nearest triangle; nullopt if the path ends on a triangle, where the direction is
// undefined.
std::optional<MeshContact> mesh_contact(const collision::Bvh& tree,
                                        std::span<const Eigen::Vector3d> vertices_before_m,
                                        double moved_m, const PathInStep& path);

}  // namespace fivepipe::sim
