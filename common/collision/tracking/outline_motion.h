// How a rigid thing moved, from its outlines in several cameras at several times (motion from
// silhouettes: Cipolla, Astrom and Giblin, 1995; Wong and Cipolla, 2001).
//
//        eye a ------------------- eye b     A plane through the centres of two cameras that
//        touches the outline of one touches that of the
//             \ \               / /          other: both touch the same point of the thing. Where
//             the cameras look at different times, one is
//              \   \  .---.  /   /           taken along with the motion; how far the two planes
//              then come apart says how wrong that is.
//               \    (     )    /
//                \    `---'    /             It is the thing that is asked, not its hull, whose
//                excess changes with the pose.
//
// Least squares over pairs of times half the window apart and pairs of cameras, a thousand at most
// (Gauss and Newton). Whether the shape determines the turn about an axis is tried where the
// velocity fits: turned by a little more and less, the planes must come apart.
#pragma once
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "common/collision/tracking/component_outlines.h"

namespace fivepipe::collision {

struct OutlineSnapshot {
  double time_s;
  Eigen::Vector3d centroid_world_m;  // of the thing, about
  std::vector<ComponentOutline> outlines;
};

// Of the middle, straight and even; about it, even.
struct UniformMotion {
  Eigen::Vector3d velocity_world_m_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_velocity_world_rad_s = Eigen::Vector3d::Zero();
};

struct OutlineMotion {
  UniformMotion motion;
  int determined_axes = 0;  // of rotation: 0, 2 or 3; about the others none is reported. 0, too,
                            // where it turned or moved too unevenly to tell
  double residual_m = 0;    // by which the planes come apart with this motion, root mean square: a
                            // pixel's footprint; more: not rigid, or uneven
};

// The motion that fits best, from a first guess; times ascend. size_m: the thing's, root mean
// square from its middle. Nothing where cameras or times are too few, or no motion is found near
// the guess.
std::optional<OutlineMotion> outline_motion(const std::deque<OutlineSnapshot>& frames,
                                            const UniformMotion& guess, double size_m);

}  // namespace fivepipe::collision
