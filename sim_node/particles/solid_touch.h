// Contact of a particle with a virtual object that moves within a step.
//
// The particle's path in the step is a segment in the object's frame: from its place at the start
// relative to the object's pose then, to that at the end relative to the pose at the end. A
// particle that crosses a surface within the step is therefore stopped, however fast both are.
#pragma once
#include <Eigen/Core>
#include <optional>

#include "common/collision/detection/bvh.h"

namespace fivepipe::sim {

// In the object's frame.
struct PathInStep {
  Eigen::Vector3d from_m, to_m;
  double radius_m;  // of the particle
};

// A plane that the particle's center must be at least its radius in front of; object frame.
struct SolidTouch {
  Eigen::Vector3d normal;  // unit
  double distance_m;       // from the plane to the end of the path
};

// Each returns the touched plane, or nullopt if the particle stays at least its radius away or the
// path is not finite.

// A box around the origin. Its edges count as sharp, also for the particle's radius.
std::optional<SolidTouch> touch_box(const Eigen::Vector3d& half_m, const PathInStep& path);
// A ball around the origin.
std::optional<SolidTouch> touch_ball(double ball_radius_m, const PathInStep& path);

struct MeshTouch {
  SolidTouch touch;
  std::uint32_t triangle;
  Eigen::Vector3d weights;  // barycentric, of the touched point
};
// A surface with two sides; the particle stays on its side. vertices_before_m: those of the tree at
// the start of the step, if they differ (a cloth); else empty. moved_m: the longest of their moves.
// The first triangle that the path crosses stops the particle. If there is none, the particle keeps
// its radius from the nearest triangle; nullopt if the path ends on a triangle, where the direction
// is undefined.
std::optional<MeshTouch> touch_mesh(const collision::Bvh& tree,
                                    std::span<const Eigen::Vector3d> vertices_before_m,
                                    double moved_m, const PathInStep& path);

}  // namespace fivepipe::sim
