#include "capture_node/synthetic/actors/tool_hand.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "capture_node/synthetic/actors/body.h"
#include "capture_node/synthetic/actors/working_hand.h"

namespace fivepipe::capture {

using Eigen::Vector3d;

HandKey key_at(std::span<const HandKey> keys, double t_s) {
  std::size_t next = 1;
  while (next + 1 < keys.size() && keys[next].t_s < t_s) ++next;
  const HandKey &a = keys[next - 1], &b = keys[next];
  const double s = std::clamp((t_s - a.t_s) / (b.t_s - a.t_s), 0.0, 1.0),
               smooth = s * s * (3 - 2 * s);
  const auto between = [&](const Vector3d& from, const Vector3d& to) -> Vector3d {
    return from + smooth * (to - from);
  };
  return {t_s,
          between(a.grip_world_m, b.grip_world_m),
          std::lerp(a.from_above, b.from_above, smooth),
          std::lerp(a.rod_radius_m, b.rod_radius_m, smooth),
          std::lerp(a.open, b.open, smooth),
          std::lerp(a.turned_rad, b.turned_rad, smooth),
          between(a.first_world_m, b.first_world_m),
          between(a.second_world_m, b.second_world_m)};
}

void add_tool_hand(std::vector<SyntheticPart>& parts, const HandKey& key, double scale,
                   const Vector3d& shoulder_world_m, const Vector3d& towards_elbow) {
  const HandShape holding = mixed(wrapped_hand(key.rod_radius_m, scale),
                                  pinching_hand(key.rod_radius_m, scale), key.from_above);
  const HandShape shape = mixed(holding, straight_hand(scale), key.open);
  const Vector3d rod_in_hand_m = rod_in_grip_m(key.rod_radius_m, scale) * (1 - key.from_above) +
                                 rod_in_pinch_m(scale) * key.from_above;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() =
      (Eigen::AngleAxisd(key.turned_rad, Vector3d::UnitZ()) *
       Eigen::AngleAxisd((1 - key.from_above) * 0.5 * std::numbers::pi, Vector3d::UnitY()))
          .toRotationMatrix();
  pose.translation() = key.grip_world_m - pose.linear() * rod_in_hand_m;
  for (const SyntheticPart& part : hand_parts(shape, scale)) parts.push_back(moved(pose, part));
  add_arm(parts, pose * wrist_in_hand_m(scale), shoulder_world_m, towards_elbow, scale);
}

}  // namespace fivepipe::capture
