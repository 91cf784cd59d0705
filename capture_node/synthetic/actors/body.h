// Hands, arms and paths that several actors share.
#pragma once
#include <span>
#include <vector>

#include "capture_node/synthetic/actors/part.h"

namespace fivepipe::capture {

// A right hand of average size, with the fingers together. They point along +y, the palm towards
// +x and the thumb down. The origin is the centre of the palm.
std::vector<SyntheticPart> flat_hand();
// The wrist, and how far the thumb stands out from the palm's centre.
inline constexpr double kFlatWrist_y_m = -0.046, kFlatThumb_x_m = 0.0275;

// Adds an arm from the wrist to the shoulder: skin, then a sleeve. The elbow is on the side of
// `towards_elbow`. The scale is that of the forearm and of all radii.
void add_arm(std::vector<SyntheticPart>& parts, const Eigen::Vector3d& wrist_world_m,
             const Eigen::Vector3d& shoulder_world_m, const Eigen::Vector3d& towards_elbow,
             double scale = 1);

// A place at a time in periods. Between two points, the motion starts and ends at rest.
struct PathPoint {
  double turn;
  Eigen::Vector3d place_world_m;
};
// `path` starts at turn 0, ends at turn 1 and ascends.
Eigen::Vector3d place_on_path(std::span<const PathPoint> path, double turn);

}  // namespace fivepipe::capture
