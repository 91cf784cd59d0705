#include "capture_node/synthetic/actors/actors.h"
#include "capture_node/synthetic/actors/body.h"

namespace fivepipe::capture {
namespace {

using Eigen::Vector3d;

const Vector3d kTrayShoulder_world_m(0.28, -0.75, 0.42);
// Half of the tray's edges.
const Vector3d kHalfTray_m(0.10, 0.10, 0.006);

// Path of the tray's upper side. It is thrown up at turn 0.5, within 0.15 s of a period of 8 s.
const PathPoint kTrayPath[] = {{0.00, {0.26, -0.10, 0.17}},   {0.36, {0.26, -0.10, 0.17}},
                               {0.46, {0.26, -0.10, 0.12}},   {0.50, {0.26, -0.10, 0.12}},
                               {0.5188, {0.26, -0.10, 0.26}}, {0.56, {0.26, -0.10, 0.17}},
                               {1.00, {0.26, -0.10, 0.17}}};

SyntheticPart wooden_box(const Vector3d& center_world_m, const Vector3d& half_m) {
  return moved(Eigen::Isometry3d(Eigen::Translation3d(center_world_m)),
               {geometry::OrientedBox{Eigen::Isometry3d::Identity(), half_m}, Material::wood});
}

}  // namespace

std::vector<SyntheticPart> hand_with_tray(double turn) {
  std::vector<SyntheticPart> parts = {wooden_box({-0.26, 0.05, 0.05}, {0.08, 0.07, 0.05}),
                                      wooden_box({0.04, 0.05, 0.08}, {0.05, 0.07, 0.08})};
  const Vector3d tray_m = place_on_path(kTrayPath, turn) - Vector3d(0, 0, kHalfTray_m.z());
  parts.push_back(wooden_box(tray_m, kHalfTray_m));
  // The palm is up; thumb and fingertips bear the tray.
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() << 0, 0, -1, 0, 1, 0, 1, 0, 0;
  pose.translation() = tray_m - Vector3d(0, 0.02, kHalfTray_m.z() + kFlatThumb_x_m);
  for (const SyntheticPart& part : flat_hand()) parts.push_back(moved(pose, part));
  add_arm(parts, pose * Vector3d(0, kFlatWrist_y_m, 0), kTrayShoulder_world_m, {0.25, 0, -0.35});
  return parts;
}

}  // namespace fivepipe::capture
