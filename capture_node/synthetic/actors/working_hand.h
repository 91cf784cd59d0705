// A right hand of any size that grips objects, for actors that work with tools.
//
// Its frame is that of a hand with the palm down: x from the thumb to the little finger, y along
// the fingers, z out of the back of the hand; the origin is the centre of the palm.
#pragma once
#include <array>
#include <vector>

#include "capture_node/synthetic/actors/part.h"

namespace fivepipe::capture {

// Length of the hand of scale 1, from the wrist to the tip of the middle finger.
inline constexpr double kHandLength_m = 0.19;

// The joints of the fingers and of the thumb, in the hand's frame.
struct HandShape {
  std::array<std::array<Eigen::Vector3d, 4>, 4> fingers_m;  // index first; from knuckle to tip
  std::array<Eigen::Vector3d, 3> thumb_m;                   // from base to tip
};

// The fingers are around a rod along x, whose axis is at rod_in_grip_m().
HandShape wrapped_hand(double rod_radius_m, double scale);
Eigen::Vector3d rod_in_grip_m(double rod_radius_m, double scale);
// The fingertips are around the upper end of a rod along z, below the palm. They are at
// rod_in_pinch_m().
HandShape pinching_hand(double rod_radius_m, double scale);
Eigen::Vector3d rod_in_pinch_m(double scale);
// The fingers are straight.
HandShape straight_hand(double scale);

// Between a (fraction 0) and b (fraction 1), joint by joint.
HandShape mixed(const HandShape& a, const HandShape& b, double fraction);

std::vector<SyntheticPart> hand_parts(const HandShape& shape, double scale);
Eigen::Vector3d wrist_in_hand_m(double scale);

}  // namespace fivepipe::capture
