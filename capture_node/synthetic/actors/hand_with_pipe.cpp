#include <cmath>
#include <numbers>

#include "capture_node/synthetic/actors/actors.h"
#include "capture_node/synthetic/actors/body.h"
#include "capture_node/synthetic/noise/noise.h"

namespace fivepipe::capture {
namespace {

using Eigen::Vector3d;

// The palm's centre moves around this box once per period and reaches each of its sides.
const Vector3d kPathCenter_m(0.0, 0.05, 0.26), kPathHalfExtent_m(0.25, 0.15, 0.14);
const Vector3d kShoulder_world_m(0.25, -0.75, 0.32);

// Frame of a right hand, palm down: x from the thumb to the little finger, y along the fingers, z
// out of the back of the hand; origin at the centre of the palm. A hand of average size.
constexpr double kKnuckle_y_m = 0.044, kWrist_y_m = -0.046;
constexpr double kPipeRadius_m = 0.020, kPipeLength_m = 0.14;
const Vector3d kPipe_hand_m(0.0, 0.050, -0.034);
struct Finger {
  double x_m, radius_m;
  double arc_radius_m;  // of the bones' arc around the pipe
};
constexpr Finger kFingers[] = {{-0.032, 0.0090, 0.0335},
                               {-0.011, 0.0095, 0.0345},
                               {0.011, 0.0090, 0.0340},
                               {0.031, 0.0080, 0.0320}};

Eigen::Isometry3d world_from_hand(double turn) {
  const double w = 2 * std::numbers::pi * turn;
  const Vector3d palm = kPathCenter_m + kPathHalfExtent_m.cwiseProduct(Vector3d(
                                            std::sin(w), std::sin(w + 1.9), std::sin(2 * w + 0.6)));
  Vector3d along = (palm - kShoulder_world_m).normalized();
  along.z() *= 0.3;  // the wrist keeps the hand nearly level
  along.normalize();
  const Vector3d side = along.cross(Vector3d::UnitZ()).normalized();
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear().col(0) = side;
  pose.linear().col(1) = along;
  pose.linear().col(2) = side.cross(along);
  pose.linear() = pose.linear() *
                  Eigen::AngleAxisd(0.5 * std::sin(w + 0.7), Vector3d::UnitY()).toRotationMatrix() *
                  Eigen::AngleAxisd(0.25 * std::sin(2 * w), Vector3d::UnitX()).toRotationMatrix();
  pose.translation() = palm;
  return pose;
}

// Three bones as chords of an arc around the pipe, from the knuckle over its far side and back
// below. `open`: 0 is a closed grip, 1 a loose one.
void add_finger(std::vector<SyntheticPart>& parts, const Finger& finger, double open) {
  constexpr double kKnuckleAngle_rad = 1.71, kBend_rad = 1.27, kLoosened_rad = 0.25,
                   kLoosened_m = 0.009;
  const double bend = kBend_rad - kLoosened_rad * open;
  Vector3d from(finger.x_m, kKnuckle_y_m, 0.0);
  for (int bone = 1; bone <= 3; ++bone) {
    const double angle = kKnuckleAngle_rad - bend * bone,
                 arc_radius_m = finger.arc_radius_m + kLoosened_m * open;
    const Vector3d to = kPipe_hand_m + Vector3d(finger.x_m, arc_radius_m * std::cos(angle),
                                                arc_radius_m * std::sin(angle));
    parts.push_back({hull::Capsule{from, to, finger.radius_m - 0.0006 * bone}, Material::skin});
    from = to;
  }
}

}  // namespace

std::vector<SyntheticPart> hand_with_pipe(double turn, std::uint64_t seed) {
  const double w = 2 * std::numbers::pi * turn;
  std::vector<SyntheticPart> parts;
  const auto add_skin = [&](const Vector3d& a_m, const Vector3d& b_m, double radius_m) {
    parts.push_back({hull::Capsule{a_m, b_m, radius_m}, Material::skin});
  };
  for (const Finger& finger : kFingers)  // palm
    add_skin({finger.x_m, kKnuckle_y_m, 0}, {0.55 * finger.x_m, kWrist_y_m, 0}, 0.0125);
  add_skin({-0.026, -0.026, -0.008}, {-0.030, 0.020, -0.012}, 0.013);  // ball of the thumb
  for (std::size_t i = 0; i < std::size(kFingers); ++i) {
    const double phase = 2 * std::numbers::pi * unit_hash(splitmix64(seed, i));
    add_finger(parts, kFingers[i], 0.5 + 0.5 * std::sin(2 * w + phase));
  }
  const double thumb = 0.004 * std::sin(w);
  add_skin({-0.034, -0.012, -0.014}, {-0.040, 0.018, -0.042}, 0.0105);
  add_skin({-0.040, 0.018, -0.042}, {-0.024, 0.038 + thumb, -0.063}, 0.0095);
  const Vector3d half_pipe(0.5 * kPipeLength_m - kPipeRadius_m, 0, 0);  // without the round ends
  parts.push_back({hull::Capsule{kPipe_hand_m - half_pipe, kPipe_hand_m + half_pipe, kPipeRadius_m},
                   Material::pipe});

  const Eigen::Isometry3d pose = world_from_hand(turn);
  for (SyntheticPart& part : parts) part = moved(pose, part);
  add_arm(parts, pose * Vector3d(0, kWrist_y_m, 0), kShoulder_world_m, {0.15, 0, -0.2});
  return parts;
}

}  // namespace fivepipe::capture
