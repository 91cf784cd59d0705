#include <algorithm>
#include <cmath>

#include "capture_node/synthetic/world.h"

namespace fivepipe::capture {
namespace {

using Eigen::Vector3d;

// Path of the right palm's centre; the left hand mirrors it in x. Between two points the hand
// starts and ends at rest.
struct PathPoint {
  double turn, x_m, y_m, z_m;
};
constexpr PathPoint kPath[] = {{0.00, 0.022, -0.26, 0.34}, {0.06, 0.022, -0.26, 0.34},
                               {0.22, 0.022, 0.02, 0.36},  {0.26, 0.022, 0.02, 0.36},
                               {0.52, 0.215, 0.02, 0.37},  {0.74, 0.215, 0.02, 0.37},
                               {0.88, 0.190, -0.26, 0.34}, {1.00, 0.022, -0.26, 0.34}};
const Vector3d kRightShoulder_world_m(0.20, -0.75, 0.40);

Vector3d palm_world_m(double turn) {
  std::size_t next = 1;
  while (next + 1 < std::size(kPath) && kPath[next].turn < turn) ++next;
  const PathPoint &a = kPath[next - 1], &b = kPath[next];
  const double s = std::clamp((turn - a.turn) / (b.turn - a.turn), 0.0, 1.0),
               smooth = s * s * (3 - 2 * s);
  return {std::lerp(a.x_m, b.x_m, smooth), std::lerp(a.y_m, b.y_m, smooth),
          std::lerp(a.z_m, b.z_m, smooth)};
}

// A right hand whose fingers point along +y, palm towards +x and thumb down. The origin is the
// centre of the palm. An average hand, with the fingers together.
std::vector<SyntheticPart> flat_hand() {
  constexpr double kFlatKnuckle_y_m = 0.044, kFlatWrist_y_m = -0.046;
  struct FlatFinger {
    double z_m, radius_m, length_m;
  };
  constexpr FlatFinger kFlatFingers[] = {{-0.031, 0.0090, 0.070},
                                         {-0.011, 0.0095, 0.080},
                                         {0.010, 0.0090, 0.074},
                                         {0.029, 0.0080, 0.058}};
  std::vector<SyntheticPart> parts;
  for (const FlatFinger& finger : kFlatFingers) {
    const Vector3d knuckle(0, kFlatKnuckle_y_m, finger.z_m),
        joint(0.004, kFlatKnuckle_y_m + 0.5 * finger.length_m, 0.95 * finger.z_m),
        tip(0.014, kFlatKnuckle_y_m + finger.length_m, 0.88 * finger.z_m);
    parts.push_back(
        {{knuckle, {0, kFlatWrist_y_m, 0.55 * finger.z_m}, 0.0125}, Material::skin});  // palm
    parts.push_back({{knuckle, joint, finger.radius_m}, Material::skin});
    parts.push_back({{joint, tip, 0.92 * finger.radius_m}, Material::skin});
  }
  const Vector3d ball(0.010, -0.016, -0.026), thumb(0.016, 0.020, -0.052);
  parts.push_back({{{0.006, -0.030, -0.012}, ball, 0.014}, Material::skin});
  parts.push_back({{ball, thumb, 0.0115}, Material::skin});
  parts.push_back({{thumb, {0.018, 0.048, -0.058}, 0.0095}, Material::skin});
  return parts;
}

}  // namespace

std::vector<SyntheticPart> parting_hands(double turn) {
  const Vector3d palm_m = palm_world_m(turn);
  std::vector<SyntheticPart> right = flat_hand();
  for (SyntheticPart& part : right) {
    part.capsule.a_world_m += palm_m;
    part.capsule.b_world_m += palm_m;
  }
  add_arm(right, palm_m + Vector3d(0, -0.046, 0), kRightShoulder_world_m, {0.35, 0, -0.25});
  std::vector<SyntheticPart> parts = right;
  for (SyntheticPart part : right) {
    part.capsule.a_world_m.x() *= -1;
    part.capsule.b_world_m.x() *= -1;
    parts.push_back(part);
  }
  return parts;
}

}  // namespace fivepipe::capture
