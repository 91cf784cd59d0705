#include "capture_node/synthetic/shading.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "capture_node/synthetic/noise/noise.h"
#include "capture_node/synthetic/surroundings.h"

namespace fivepipe::capture {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

const Vector3f kSkin_bgr(140, 172, 225), kSleeve_bgr(60, 140, 40), kPipe_bgr(38, 120, 214),
    kWood_bgr(104, 160, 206), kCord_bgr(190, 70, 30), kConnector_bgr(70, 40, 150),
    kTongs_bgr(40, 190, 220);

// A point of a surface: coordinates for the colour, and the unit normal.
struct SurfacePoint {
  Vector3f in_part_m;
  Vector3f normal_world;
};

SurfacePoint surface_point(const hull::Capsule& capsule, const Vector3d& p_world_m) {
  const Vector3d segment = capsule.b_world_m - capsule.a_world_m, axis = segment.normalized();
  const Vector3d side =
      (std::abs(axis.z()) < 0.9 ? axis.cross(Vector3d::UnitZ()) : axis.cross(Vector3d::UnitX()))
          .normalized();
  const Vector3d from_a = p_world_m - capsule.a_world_m;
  const double squared = segment.squaredNorm(),
               along = squared > 0 ? std::clamp(from_a.dot(segment) / squared, 0.0, 1.0) : 0.0;
  return {Vector3f(float(from_a.dot(axis)), float(from_a.dot(side)),
                   float(from_a.dot(axis.cross(side)))),
          (from_a - along * segment).normalized().cast<float>()};
}

// The normal is that of the face whose plane is nearest.
SurfacePoint surface_point(const geometry::OrientedBox& box, const Vector3d& p_world_m) {
  const Vector3d p = box.world_from_box.inverse() * p_world_m;
  Eigen::Index axis = 0;
  (box.half_m - p.cwiseAbs()).cwiseAbs().minCoeff(&axis);
  Vector3d normal = Vector3d::Zero();
  normal[axis] = p[axis] < 0 ? -1 : 1;
  return {p.cast<float>(), (box.world_from_box.linear() * normal).cast<float>()};
}

// A surface's own colour, from value noise in the part's frame.
Vector3f own_colour(Material material, const Vector3f& p) {
  switch (material) {
    case Material::skin: {
      const float flush = value_noise(17, 60 * p.x(), 60 * p.y(), 60 * p.z()),
                  fine = value_noise(19, 400 * p.x(), 400 * p.y(), 400 * p.z());
      return kSkin_bgr + (flush - 0.5f) * Vector3f(-26, -20, 12) +
             Vector3f::Constant(14 * (fine - 0.5f));
    }
    case Material::sleeve: {
      const float weave = value_noise(29, 300 * p.x(), 300 * p.y(), 300 * p.z());
      return kSleeve_bgr + Vector3f::Constant(16 * (weave - 0.5f));
    }
    case Material::pipe: {
      const bool ring = std::abs(std::abs(p.x() - 0.05f) - 0.045f) < 0.004f;
      return ring ? Vector3f(24, 84, 156)
                  : Vector3f(
                        kPipe_bgr +
                        Vector3f::Constant(
                            16 * (value_noise(23, 30 * p.x(), 300 * p.y(), 300 * p.z()) - 0.5f)));
    }
    case Material::wood: {  // its grain is along x
      const float grain = value_noise(31, 12 * p.x(), 220 * p.y(), 220 * p.z()),
                  year = value_noise(37, 6 * p.x(), 45 * p.y(), 45 * p.z());
      return kWood_bgr + (grain - 0.5f) * Vector3f(18, 22, 24) +
             (year - 0.5f) * Vector3f(22, 30, 34);
    }
    case Material::cord: return kCord_bgr;
    case Material::connector: return kConnector_bgr;
    case Material::tongs: return kTongs_bgr;
  }
  return kSkin_bgr;
}

// Points of the unit disc, each for the same area (sunflower, Vogel 1979).
constexpr int kLampPoints = 64;
std::array<Eigen::Vector2f, kLampPoints> disc_points() {
  constexpr float kGoldenAngle_rad = 2.39996323f;
  std::array<Eigen::Vector2f, kLampPoints> points;
  for (int i = 0; i < kLampPoints; ++i) {
    const float radius = std::sqrt((float(i) + 0.5f) / kLampPoints),
                angle = float(i) * kGoldenAngle_rad;
    points[std::size_t(i)] = {radius * std::cos(angle), radius * std::sin(angle)};
  }
  return points;
}

}  // namespace

Vector3f shaded(const SyntheticPart& part, const Vector3d& p_world_m, const Vector3d& eye_world_m) {
  const SurfacePoint at =
      std::visit([&](const auto& shape) { return surface_point(shape, p_world_m); }, part.shape);
  const Vector3f p = p_world_m.cast<float>();
  const Vector3f bgr = own_colour(part.material, at.in_part_m) * brightness(p, at.normal_world, 1);
  const Vector3f to_eye = (eye_world_m - p_world_m).normalized().cast<float>();
  const Vector3f half_way = ((lamp::kPosition_world_m - p).normalized() + to_eye).normalized();
  const float shine = std::max(0.0f, at.normal_world.dot(half_way));
  const float strength = part.material == Material::pipe   ? 60.0f
                         : part.material == Material::skin ? 14.0f
                                                           : 0.0f;
  return bgr + Vector3f::Constant(strength * std::pow(shine, 24.0f));
}

float lamp_visibility_past(const hull::Capsule& capsule, const Vector3f& p_world_m) {
  const Vector3f a = capsule.a_world_m.cast<float>(),
                 d2 = (capsule.b_world_m - capsule.a_world_m).cast<float>();
  const Vector3f d1 = lamp::kPosition_world_m - p_world_m, r = p_world_m - a;
  // Closest points of the segments p + s d1 and a + t d2 (Ericson, Real-Time Collision
  // Detection, 5.1.9).
  const float aa = d1.squaredNorm(), e = d2.squaredNorm(), f = d2.dot(r), c = d1.dot(r),
              b = d1.dot(d2), denominator = aa * e - b * b;
  const float s_of_lines =
      denominator > 0 ? std::clamp((b * f - c * e) / denominator, 0.0f, 1.0f) : 0.0f;
  const float t = e > 0 ? std::clamp((b * s_of_lines + f) / e, 0.0f, 1.0f) : 0.0f;
  // The point of the segment to the lamp that is nearest to the capsule at t. It is not that at
  // s_of_lines if t was clamped or the capsule is a sphere.
  const float s = std::clamp((b * t - c) / aa, 0.0f, 1.0f);
  const float clearance = (r + s * d1 - t * d2).norm() - float(capsule.radius_m);
  // Without this minimum, the width would be zero at points at which the capsule touches the table.
  constexpr float kMinPenumbra_m = 1e-4f;
  const float half_shadow = lamp::kRadius_m * s + kMinPenumbra_m;
  return std::clamp(0.5f + 0.5f * clearance / half_shadow, 0.0f, 1.0f);
}

float lamp_visibility_past(const geometry::OrientedBox& box, const Vector3f& p_world_m) {
  static const std::array<Eigen::Vector2f, kLampPoints> kDisc = disc_points();
  const Vector3d p = p_world_m.cast<double>(), lamp = lamp::kPosition_world_m.cast<double>();
  const Vector3d to_lamp = lamp - p, u = to_lamp.unitOrthogonal(),
                 v = to_lamp.normalized().cross(u);
  int seen = 0;
  for (const Eigen::Vector2f& point : kDisc) {
    const Vector3d at =
        lamp + double(lamp::kRadius_m) * (double(point.x()) * u + double(point.y()) * v);
    const std::optional<double> entry = geometry::ray_entry(box, {p, at - p});
    seen += !(entry && *entry < 1);
  }
  return float(seen) / kLampPoints;
}

}  // namespace fivepipe::capture
