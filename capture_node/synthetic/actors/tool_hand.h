// A right hand with its arm that moves along a list of keys, with a grip for each.
#pragma once
#include <span>
#include <vector>

#include "capture_node/synthetic/actors/part.h"

namespace fivepipe::capture {

// The hand at one time. Between two keys all values change smoothly, from rest to rest.
struct HandKey {
  double t_s;
  // Of the axis of what the hand holds: from the side, at the middle of the hand; from above, at
  // the fingertips.
  Eigen::Vector3d grip_world_m;
  double from_above;    // 0: from the right, the thumb up; 1: from above, the palm down
  double rod_radius_m;  // of what the fingers are around
  double open;          // 0: the fingers hold; 1: they are straight
  double turned_rad;    // about the vertical through the grip
  // The objects that the hand moves; their meaning is that of the actor.
  Eigen::Vector3d first_world_m, second_world_m;
};

// `keys` has at least two and ascends strictly. Before the first and after the last one, the values
// are those of that key.
HandKey key_at(std::span<const HandKey> keys, double t_s);

// Adds the hand and its arm.
void add_tool_hand(std::vector<SyntheticPart>& parts, const HandKey& key, double scale,
                   const Eigen::Vector3d& shoulder_world_m, const Eigen::Vector3d& towards_elbow);

}  // namespace fivepipe::capture
