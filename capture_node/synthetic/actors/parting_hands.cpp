#include "capture_node/synthetic/actors/actors.h"
#include "capture_node/synthetic/actors/body.h"

namespace fivepipe::capture {
namespace {

using Eigen::Vector3d;

// Path of the right palm's centre; the left hand mirrors it in x.
const PathPoint kPartingPath[] = {{0.00, {0.022, -0.26, 0.34}}, {0.06, {0.022, -0.26, 0.34}},
                                  {0.22, {0.022, 0.02, 0.36}},  {0.26, {0.022, 0.02, 0.36}},
                                  {0.52, {0.215, 0.02, 0.37}},  {0.74, {0.215, 0.02, 0.37}},
                                  {0.88, {0.190, -0.26, 0.34}}, {1.00, {0.022, -0.26, 0.34}}};
const Vector3d kRightShoulder_world_m(0.20, -0.75, 0.40);

}  // namespace

std::vector<SyntheticPart> parting_hands(double turn) {
  const Vector3d palm_m = place_on_path(kPartingPath, turn);
  std::vector<SyntheticPart> right;
  for (const SyntheticPart& part : flat_hand())
    right.push_back(moved(Eigen::Isometry3d(Eigen::Translation3d(palm_m)), part));
  add_arm(right, palm_m + Vector3d(0, kFlatWrist_y_m, 0), kRightShoulder_world_m, {0.35, 0, -0.25});
  std::vector<SyntheticPart> parts = right;
  for (const SyntheticPart& part : right) {
    hull::Capsule left = std::get<hull::Capsule>(part.shape);
    left.a_world_m.x() *= -1;
    left.b_world_m.x() *= -1;
    parts.push_back({left, part.material});
  }
  return parts;
}

}  // namespace fivepipe::capture
