#include <algorithm>
#include <cmath>

#include "capture_node/synthetic/actors/actors.h"
#include "capture_node/synthetic/actors/body.h"
#include "capture_node/synthetic/actors/working_hand.h"

namespace fivepipe::capture {
namespace {

using Eigen::Vector3d;

const Vector3d kReachShoulder_world_m(0.05, -0.55, 0.50), kLeanShoulder_world_m(0.42, -0.55, 0.48);
// From the shoulder to the wrist with the arm straight, for a hand of scale 1.
constexpr double kArm_m = 0.56;
// Where the reaching hand goes: along the line from the shoulder, into the filter of scenes/engine.
constexpr double kTarget_m = 0.73, kStart_m = 0.40;  // of the fingertips, from the shoulder
const Vector3d kReachDirection = Vector3d(-0.03, 0.68, -0.42).normalized();
// Of the middle finger, from the centre of the straight hand's palm.
constexpr double kFingertip_m = 0.124;

// The other hand of the same pose.
SyntheticPart mirrored_x(SyntheticPart part) {
  auto& capsule = std::get<hull::Capsule>(part.shape);
  capsule.a_world_m.x() *= -1;
  capsule.b_world_m.x() *= -1;
  return part;
}

}  // namespace

std::vector<SyntheticPart> reaching_arm(double turn, double hand_length_m, bool leans) {
  const double scale = hand_length_m / kHandLength_m;
  const Vector3d wrist_m = wrist_in_hand_m(scale);
  const double to_palm_m = kFingertip_m * scale,
               longest_m = kArm_m * scale - wrist_m.y() + to_palm_m;
  // In from 0.1 to 0.4, back from 0.6 to 0.9.
  const double s = std::clamp((0.4 - std::abs(turn - 0.5)) / 0.3, 0.0, 1.0),
               fingertip_m =
                   std::lerp(kStart_m, std::min(kTarget_m, longest_m), s * s * (3 - 2 * s));

  std::vector<SyntheticPart> parts;
  // A left hand with the thumb up and the palm to the right. The hand's frame is that of a right
  // hand, mirrored in x: its x points down, y along the arm.
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  const Vector3d down = (-Vector3d::UnitZ() + kReachDirection.z() * kReachDirection).normalized();
  pose.linear().col(0) = -down;
  pose.linear().col(1) = kReachDirection;
  pose.linear().col(2) = (-down).cross(kReachDirection);
  pose.translation() = kReachShoulder_world_m + (fingertip_m - to_palm_m) * kReachDirection;
  for (const SyntheticPart& part : hand_parts(straight_hand(scale), scale))
    parts.push_back(moved(pose, mirrored_x(part)));
  add_arm(parts, pose * wrist_m, kReachShoulder_world_m, {-0.05, 0, -0.10}, scale);
  if (!leans) return parts;

  // The right hand leans on the table, its fingers away from the person.
  Eigen::Isometry3d lean = Eigen::Isometry3d::Identity();
  lean.translation() = Vector3d(0.38, 0.02, 0.055 * scale);
  for (const SyntheticPart& part : hand_parts(straight_hand(scale), scale))
    parts.push_back(moved(lean, part));
  add_arm(parts, lean * wrist_m, kLeanShoulder_world_m, {0.1, 0, 0.6}, scale);
  return parts;
}

}  // namespace fivepipe::capture
