// Rigid motion of an object from its outlines in several cameras at several times (motion from
// silhouettes: Cipolla, Astrom and Giblin, 1995; Wong and Cipolla, 2001).
//
//    eye a ------------------- eye b    A plane through both cameras' centres that is tangent to
//         \ \               / /         one outline is tangent to the other: both touch the same
//          \   \  .---.  /   /          point of the object (epipolar tangency). If the images
//           \    (     )    /           are of different times, one camera is moved with the
//            \    `---'    /            object. The distance between the two planes is the
//                                       residual of the motion.
//
// The method uses the object itself, not its hull, whose excess volume changes with the pose.
//
// Gauss-Newton least squares over pairs of times half a window apart and pairs of cameras, at most
// kMaxPairs of them. To test whether the shape determines the rotation about an axis, the fit
// rotates the object a little in both directions; the planes must then separate.
#pragma once
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "common/collision/tracking/component_outlines.h"

namespace fivepipe::collision {

struct OutlineSnapshot {
  double time_s;
  Eigen::Vector3d centroid_world_m;  // of the object, approximate
  std::vector<ComponentOutline> outlines;
};

// Constant velocity of the centroid and constant angular velocity about it.
struct UniformMotion {
  Eigen::Vector3d velocity_world_m_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_velocity_world_rad_s = Eigen::Vector3d::Zero();
};

struct OutlineMotion {
  UniformMotion motion;
  // Number of axes about which the rotation is determined: 0, 2 or 3. The angular velocity is zero
  // about the others. Also 0 if the motion is too uneven to determine any.
  int determined_axes = 0;
  // RMS distance between the pairs of planes under this motion. About one pixel footprint for a
  // rigid, uniform motion; larger otherwise.
  double residual_m = 0;
};

// Returns the best fit, starting from `guess`; rest if that fits nearly as well. Times must ascend.
// size_m is the object's RMS distance from its centroid. Returns nullopt if there are too few
// cameras or times, or if no motion near the guess fits.
std::optional<OutlineMotion> outline_motion(const std::deque<OutlineSnapshot>& frames,
                                            const UniformMotion& guess, double size_m);

}  // namespace fivepipe::collision
