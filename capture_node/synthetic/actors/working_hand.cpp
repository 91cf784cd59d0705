#include "capture_node/synthetic/actors/working_hand.h"

#include <algorithm>
#include <cmath>

namespace fivepipe::capture {
namespace {

using Eigen::Vector3d;

// Of the hand of scale 1.
constexpr double kGripKnuckle_y_m = 0.044, kGripWrist_y_m = -0.046, kPinch_y_m = 0.040,
                 kPinchDepth_m = 0.075, kPalmRadius_m = 0.0125;
struct GripFinger {
  double x_m, radius_m, bone_m;
  double pinch_angle_rad;  // of the fingertip around a rod, from y towards x
};
constexpr GripFinger kGripFingers[] = {{-0.032, 0.0090, 0.0397, -0.6},
                                       {-0.011, 0.0095, 0.0409, 0.1},
                                       {0.011, 0.0090, 0.0403, 0.8},
                                       {0.031, 0.0080, 0.0379, 1.45}};
// Between the bones' arc and a rod, beyond the finger's radius.
constexpr double kArcSlack_m = 0.0045;
// From the rod's axis to the knuckles, as an angle from y towards z.
constexpr double kGripKnuckleAngle_rad = 1.71;

double arc_radius_m(const GripFinger& finger, double rod_radius_m, double scale) {
  return rod_radius_m + (finger.radius_m + kArcSlack_m) * scale;
}

}  // namespace

Vector3d rod_in_grip_m(double rod_radius_m, double scale) {
  const double radius_m = arc_radius_m(kGripFingers[1], rod_radius_m, scale);
  return {0, kGripKnuckle_y_m * scale - radius_m * std::cos(kGripKnuckleAngle_rad),
          -radius_m * std::sin(kGripKnuckleAngle_rad)};
}

HandShape wrapped_hand(double rod_radius_m, double scale) {
  constexpr double kMaxBend_rad = 1.4;
  const Vector3d rod_m = rod_in_grip_m(rod_radius_m, scale);
  HandShape shape;
  for (std::size_t i = 0; i < std::size(kGripFingers); ++i) {
    const GripFinger& finger = kGripFingers[i];
    const double radius_m = arc_radius_m(finger, rod_radius_m, scale),
                 half_chord = std::min(1.0, 0.5 * finger.bone_m * scale / radius_m),
                 bend_rad = std::min(kMaxBend_rad, 2 * std::asin(half_chord));
    const double x_m = finger.x_m * scale;
    shape.fingers_m[i][0] = {x_m, kGripKnuckle_y_m * scale, 0};
    for (std::size_t bone = 1; bone < 4; ++bone) {
      const double angle_rad = kGripKnuckleAngle_rad - bend_rad * double(bone);
      shape.fingers_m[i][bone] =
          rod_m + Vector3d(x_m, radius_m * std::cos(angle_rad), radius_m * std::sin(angle_rad));
    }
  }
  const double to_joint_m = rod_radius_m + 0.013 * scale, to_tip_m = rod_radius_m + 0.0095 * scale;
  shape.thumb_m = {scale * Vector3d(-0.034, -0.012, -0.014),
                   rod_m + Vector3d(-0.040 * scale, -0.97 * to_joint_m, -0.24 * to_joint_m),
                   rod_m + Vector3d(-0.024 * scale, -0.40 * to_tip_m, -0.92 * to_tip_m)};
  return shape;
}

Vector3d rod_in_pinch_m(double scale) { return scale * Vector3d(0, kPinch_y_m, -kPinchDepth_m); }

HandShape pinching_hand(double rod_radius_m, double scale) {
  const Vector3d rod_m = rod_in_pinch_m(scale);
  // The tips of ring and little finger have no place at a thin rod and are beside it.
  constexpr double kAllFit_m = 0.020;
  const double beside = std::max(0.0, 1 - rod_radius_m / kAllFit_m);
  HandShape shape;
  for (std::size_t i = 0; i < std::size(kGripFingers); ++i) {
    const GripFinger& finger = kGripFingers[i];
    auto& [knuckle, first, second, tip] = shape.fingers_m[i];
    const double to_tip_m = rod_radius_m + finger.radius_m * scale;
    knuckle = scale * Vector3d(finger.x_m, kGripKnuckle_y_m, 0);
    tip = rod_m + Vector3d(to_tip_m * std::sin(finger.pinch_angle_rad) +
                               0.6 * beside * scale * std::max(0.0, finger.x_m),
                           to_tip_m * std::cos(finger.pinch_angle_rad), 0);
    first = knuckle + finger.bone_m * scale * Vector3d(0, 0.83, -0.55);
    second = 0.5 * (first + tip) + scale * Vector3d(0, 0.010, 0);
  }
  shape.thumb_m = {scale * Vector3d(-0.034, -0.012, -0.014),
                   rod_m + Vector3d(-0.030 * scale, -rod_radius_m - 0.019 * scale, 0.034 * scale),
                   rod_m + Vector3d(-0.004 * scale, -rod_radius_m - 0.0095 * scale, 0.002 * scale)};
  return shape;
}

HandShape straight_hand(double scale) {
  HandShape shape;
  for (std::size_t i = 0; i < std::size(kGripFingers); ++i) {
    const GripFinger& finger = kGripFingers[i];
    // The fingers bend a little towards the palm.
    const Vector3d along[] = {{0, 0, 0}, {0, 0.95, -0.12}, {0, 1.65, -0.30}, {0, 2.2, -0.55}};
    for (std::size_t joint = 0; joint < 4; ++joint)
      shape.fingers_m[i][joint] =
          scale * (Vector3d(finger.x_m, kGripKnuckle_y_m, 0) + 0.9 * finger.bone_m * along[joint]);
  }
  shape.thumb_m = {scale * Vector3d(-0.034, -0.012, -0.014),
                   scale * Vector3d(-0.052, 0.016, -0.020),
                   scale * Vector3d(-0.056, 0.042, -0.024)};
  return shape;
}

HandShape mixed(const HandShape& a, const HandShape& b, double fraction) {
  HandShape shape;
  const auto between = [&](const Vector3d& from, const Vector3d& to) -> Vector3d {
    return from + fraction * (to - from);
  };
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t joint = 0; joint < 4; ++joint)
      shape.fingers_m[i][joint] = between(a.fingers_m[i][joint], b.fingers_m[i][joint]);
  for (std::size_t joint = 0; joint < 3; ++joint)
    shape.thumb_m[joint] = between(a.thumb_m[joint], b.thumb_m[joint]);
  return shape;
}

std::vector<SyntheticPart> hand_parts(const HandShape& shape, double scale) {
  std::vector<SyntheticPart> parts;
  const auto add = [&](const Vector3d& a_m, const Vector3d& b_m, double radius_m) {
    parts.push_back({hull::Capsule{a_m, b_m, radius_m * scale}, Material::skin});
  };
  for (const GripFinger& finger : kGripFingers)
    add(scale * Vector3d(finger.x_m, kGripKnuckle_y_m, 0),
        scale * Vector3d(0.55 * finger.x_m, kGripWrist_y_m, 0), kPalmRadius_m);
  add(scale * Vector3d(-0.026, -0.026, -0.008), scale * Vector3d(-0.030, 0.020, -0.012), 0.013);
  for (std::size_t i = 0; i < std::size(kGripFingers); ++i)
    for (std::size_t bone = 1; bone < 4; ++bone)
      add(shape.fingers_m[i][bone - 1], shape.fingers_m[i][bone],
          kGripFingers[i].radius_m - 0.0006 * double(bone));
  add(shape.thumb_m[0], shape.thumb_m[1], 0.0105);
  add(shape.thumb_m[1], shape.thumb_m[2], 0.0095);
  return parts;
}

Vector3d wrist_in_hand_m(double scale) { return {0, kGripWrist_y_m * scale, 0}; }

}  // namespace fivepipe::capture
