#include "capture_node/synthetic/actors/actors.h"
#include "capture_node/synthetic/actors/body.h"

namespace fivepipe::capture {
namespace {

using Eigen::Vector3d;

const Vector3d kCatchShoulder_world_m(0.28, -0.75, 0.42);
// Path of the palm's surface: into the stream, up, and back.
const PathPoint kCatchPath[] = {
    {0.00, {0.24, -0.12, 0.22}}, {0.12, {0.24, -0.12, 0.22}},   {0.27, {0.00, -0.01, 0.24}},
    {0.52, {0.00, -0.01, 0.20}}, {0.5388, {0.00, -0.01, 0.31}}, {0.60, {0.00, -0.01, 0.24}},
    {0.70, {0.00, -0.01, 0.24}}, {0.78, {0.24, -0.12, 0.22}},   {1.00, {0.24, -0.12, 0.22}}};

}  // namespace

std::vector<SyntheticPart> catching_hand(double turn) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() << 0, 0, -1, 0, 1, 0, 1, 0, 0;  // palm up
  pose.translation() = place_on_path(kCatchPath, turn);
  std::vector<SyntheticPart> parts;
  for (const SyntheticPart& part : flat_hand()) parts.push_back(moved(pose, part));
  add_arm(parts, pose * Vector3d(0, kFlatWrist_y_m, 0), kCatchShoulder_world_m, {0.25, 0, -0.35});
  return parts;
}

}  // namespace fivepipe::capture
