#include "capture_node/synthetic/actors/actors.h"
#include "capture_node/synthetic/actors/body.h"

namespace fivepipe::capture {
namespace {

using Eigen::Vector3d;

const Vector3d kPushShoulder_world_m(0.22, -0.75, 0.38);
// Path of the palm's centre.
const PathPoint kPushPath[] = {{0.00, {0.10, -0.15, 0.28}}, {0.10, {0.10, -0.15, 0.28}},
                               {0.45, {0.08, 0.15, 0.30}},  {0.55, {0.08, 0.15, 0.30}},
                               {0.75, {0.10, -0.15, 0.28}}, {1.00, {0.10, -0.15, 0.28}}};

}  // namespace

std::vector<SyntheticPart> pushing_hand(double turn) {
  // Fingers up, palm away from the person, thumb to the left.
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  pose.translation() = place_on_path(kPushPath, turn);
  std::vector<SyntheticPart> parts;
  for (const SyntheticPart& part : flat_hand()) parts.push_back(moved(pose, part));
  add_arm(parts, pose * Vector3d(0, kFlatWrist_y_m, 0), kPushShoulder_world_m, {0.35, 0, -0.3});
  return parts;
}

}  // namespace fivepipe::capture
