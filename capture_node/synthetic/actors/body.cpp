#include "capture_node/synthetic/actors/body.h"

#include <algorithm>

namespace fivepipe::capture {

using Eigen::Vector3d;

std::vector<SyntheticPart> flat_hand() {
  constexpr double kKnuckle_y_m = 0.044;
  struct Finger {
    double z_m, radius_m, length_m;
  };
  constexpr Finger kFingers[] = {{-0.031, 0.0090, 0.070},
                                 {-0.011, 0.0095, 0.080},
                                 {0.010, 0.0090, 0.074},
                                 {0.029, 0.0080, 0.058}};
  std::vector<SyntheticPart> parts;
  const auto add = [&](const Vector3d& a_m, const Vector3d& b_m, double radius_m) {
    parts.push_back({hull::Capsule{a_m, b_m, radius_m}, Material::skin});
  };
  for (const Finger& finger : kFingers) {
    const Vector3d knuckle(0, kKnuckle_y_m, finger.z_m),
        joint(0.004, kKnuckle_y_m + 0.5 * finger.length_m, 0.95 * finger.z_m),
        tip(0.014, kKnuckle_y_m + finger.length_m, 0.88 * finger.z_m);
    add(knuckle, {0, kFlatWrist_y_m, 0.55 * finger.z_m}, 0.0125);
    add(knuckle, joint, finger.radius_m);
    add(joint, tip, 0.92 * finger.radius_m);
  }
  const Vector3d ball(0.010, -0.016, -0.026), thumb(0.016, 0.020, -0.052);
  add({0.006, -0.030, -0.012}, ball, 0.014);
  add(ball, thumb, 0.0115);
  add(thumb, {0.018, 0.048, -0.058}, 0.0095);
  return parts;
}

void add_arm(std::vector<SyntheticPart>& parts, const Vector3d& wrist_world_m,
             const Vector3d& shoulder_world_m, const Vector3d& towards_elbow, double scale) {
  constexpr double kForearm_m = 0.26;
  const Vector3d to_shoulder = (shoulder_world_m - wrist_world_m).normalized();
  const Vector3d elbow =
      wrist_world_m + kForearm_m * scale * (to_shoulder + towards_elbow).normalized();
  const Vector3d sleeve_edge = wrist_world_m + 0.4 * (elbow - wrist_world_m);
  parts.push_back({hull::Capsule{wrist_world_m, sleeve_edge, 0.026 * scale}, Material::skin});
  parts.push_back({hull::Capsule{sleeve_edge, elbow, 0.038 * scale}, Material::sleeve});
  parts.push_back({hull::Capsule{elbow, shoulder_world_m, 0.046 * scale}, Material::sleeve});
}

Vector3d place_on_path(std::span<const PathPoint> path, double turn) {
  std::size_t next = 1;
  while (next + 1 < path.size() && path[next].turn < turn) ++next;
  const PathPoint &a = path[next - 1], &b = path[next];
  const double s = std::clamp((turn - a.turn) / (b.turn - a.turn), 0.0, 1.0),
               smooth = s * s * (3 - 2 * s);
  return {std::lerp(a.place_world_m.x(), b.place_world_m.x(), smooth),
          std::lerp(a.place_world_m.y(), b.place_world_m.y(), smooth),
          std::lerp(a.place_world_m.z(), b.place_world_m.z(), smooth)};
}

}  // namespace fivepipe::capture
