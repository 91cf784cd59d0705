#include "capture_node/synthetic/actors/payload_objects.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fivepipe::capture {
namespace {

using Eigen::Vector3d;

constexpr double kCordRadius_m = 0.0035, kPlugRadius_m = 0.008;

void add_capsule(std::vector<SyntheticPart>& parts, const Vector3d& a_m, const Vector3d& b_m,
                 double radius_m, Material material) {
  parts.push_back({hull::Capsule{a_m, b_m, radius_m}, material});
}

void add_block(std::vector<SyntheticPart>& parts, const Vector3d& center_m, const Vector3d& half_m,
               Material material) {
  parts.push_back(
      {geometry::OrientedBox{Eigen::Isometry3d(Eigen::Translation3d(center_m)), half_m}, material});
}

// Upright capsules around the axis through center_m.
void add_ring(std::vector<SyntheticPart>& parts, const Vector3d& center_m, double ring_radius_m,
              double half_height_m, double radius_m, int count, Material material) {
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * i / count;
    const Vector3d at = center_m + ring_radius_m * Vector3d(std::cos(angle), std::sin(angle), 0);
    const Vector3d up(0, 0, half_height_m - radius_m);
    add_capsule(parts, at - up, at + up, radius_m, material);
  }
}

}  // namespace

void add_fixtures(std::vector<SyntheticPart>& parts) {
  add_block(parts, {0, 0, 0.5 * kSeat_z_m}, {0.034, 0.034, 0.5 * kSeat_z_m}, Material::connector);
  add_capsule(parts, {0, 0, kSeat_z_m}, {0, 0, kOutlet_z_m - kPlugRadius_m}, kPlugRadius_m,
              Material::connector);
  constexpr double kHalfCollar_m = 0.010, kThread_m = 0.004;
  add_ring(parts, {0, 0, kSeat_z_m + kHalfCollar_m}, kPayloadPipeRadius_m + kThread_m + 0.001,
           kHalfCollar_m, kThread_m, 16, Material::connector);
  const double half_z_m = 0.5 * kStand_world_m.z();
  add_block(parts, kStand_world_m - Vector3d(0, 0, half_z_m), {0.03, 0.03, half_z_m},
            Material::wood);
}

void add_pipe(std::vector<SyntheticPart>& parts, const Vector3d& center_world_m) {
  constexpr double kStave_m = 0.004;
  add_ring(parts, center_world_m, kPayloadPipeRadius_m - kStave_m, 0.5 * kPayloadPipeLength_m,
           kStave_m, 14, Material::pipe);
}

void add_cord(std::vector<SyntheticPart>& parts, const Vector3d& plug_world_m, bool stiff) {
  add_capsule(parts, plug_world_m + Vector3d(0, 0, kPlugRadius_m),
              plug_world_m + Vector3d(0, 0, kPlugLength_m - kPlugRadius_m), kPlugRadius_m,
              Material::connector);
  // Over the pipe, the cord is upright as far as the rim; at the stand, only close to the plug.
  constexpr double kOver_m = 0.05, kBeside_m = 0.12, kUpright_m = 0.045;
  const double s =
      std::clamp((kBeside_m - plug_world_m.head<2>().norm()) / (kBeside_m - kOver_m), 0.0, 1.0);
  const double over = s * s * (3 - 2 * s);
  const double low_m = plug_world_m.z() + kUpright_m, rim_m = kPmtTop_z_m + (stiff ? 0.020 : 0.010);
  const double bend_z_m = std::lerp(low_m, std::max(low_m, rim_m), over);
  const double beside_m = stiff ? 0 : 0.007;  // the tongs
  const Vector3d neck = plug_world_m + Vector3d(0, -beside_m, kPlugLength_m),
                 bend(plug_world_m.x(), plug_world_m.y() - beside_m, bend_z_m);
  const std::vector<Vector3d> tail =
      stiff ? std::vector<Vector3d>{bend + Vector3d(0.012, -0.018, 0.018),
                                    bend + Vector3d(0.026, -0.060, 0.024),
                                    bend + Vector3d(0.050, -0.130, 0.010)}
            : std::vector<Vector3d>{bend + Vector3d(0.004, -0.012, 0.004),
                                    bend + Vector3d(0.016, -0.050, -0.001),
                                    bend + Vector3d(0.050, -0.150, -0.004)};
  Vector3d from = neck;
  const auto lead_to = [&](const Vector3d& to) {
    add_capsule(parts, from, to, kCordRadius_m, Material::cord);
    from = to;
  };
  lead_to(bend);
  for (const Vector3d& to : tail) lead_to(to);
  const Vector3d on_table(0.24, -0.36, kCordRadius_m);
  lead_to(on_table);
  lead_to(on_table + Vector3d(0.10, -0.06, 0));
}

void add_tongs(std::vector<SyntheticPart>& parts, const Vector3d& plug_world_m) {
  constexpr double kArm_m = 0.0035, kHandle_m = 0.006, kSpread_m = 0.006, kTip_m = 0.004;
  const Vector3d plug_top = plug_world_m + Vector3d(0, 0, kPlugLength_m);
  const auto at = [&](double x_m, double height_m) -> Vector3d {
    return plug_top + Vector3d(x_m, 0, height_m);
  };
  add_capsule(parts, at(0, kTongsLength_m - 0.030), at(0, kTongsLength_m - kHandle_m), kHandle_m,
              Material::tongs);
  for (const double side : {-1.0, 1.0}) {
    add_capsule(parts, at(side * 0.003, kTongsLength_m - 0.030), at(side * kSpread_m, 0.11), kArm_m,
                Material::tongs);
    add_capsule(parts, at(side * kSpread_m, 0.11), at(side * kTip_m, kArm_m), kArm_m,
                Material::tongs);
  }
}

}  // namespace fivepipe::capture
