// The light, the shadow and the textures of the synthetic world, each at single points.
#include "capture_node/synthetic/shading.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "tests/support/capture/capture_rig.h"

namespace fivepipe::capture {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

const Vector3d kLamp_m(0.5, -0.35, 1.9);
// Rounding of a distance between float coordinates of up to 2 m, each off by at most 0.06 um.
constexpr double kDistanceRounding_m = 4e-7;

// The nearest point of a capsule is its middle, either of its ends, or the centre of a ball, and is
// at a fraction of the way from the table to the lamp.
TEST(LampVisibility, IsTheClearanceInHalfWidthsOfThePenumbra) {
  const Vector3d p_m(-0.2, 0.1, 0), to_lamp_m = kLamp_m - p_m, up = to_lamp_m.normalized(),
                                    side = up.unitOrthogonal(), across = up.cross(side);
  constexpr double kRadius_m = 0.06, kLength_m = 0.1;
  for (const double along : {0.1, 0.5, 0.9})
    for (const double clearance : {-1.2, -1.0, -0.6, 0.0, 0.5, 1.0, 1.2}) {
      const double half_width_m = 0.05 * along + 1e-4;
      const Vector3d nearest_m =
          p_m + along * to_lamp_m + (kRadius_m + clearance * half_width_m) * side;
      const Vector3d inclined = (across + 0.7 * up).normalized(),
                     away = (across + 0.3 * side - 0.7 * up).normalized();
      for (const auto& [a_m, b_m] :
           {std::pair<Vector3d, Vector3d>{nearest_m, nearest_m},
            {nearest_m - 0.3 * kLength_m * inclined, nearest_m + 0.7 * kLength_m * inclined},
            {nearest_m, nearest_m + kLength_m * away},
            {nearest_m + kLength_m * away, nearest_m}})
        EXPECT_NEAR(lamp_visibility_past({a_m, b_m, kRadius_m}, p_m.cast<float>()),
                    std::clamp(0.5 + 0.5 * clearance, 0.0, 1.0),
                    0.5 * kDistanceRounding_m / half_width_m)
            << along << ' ' << clearance << ": " << (b_m - a_m).transpose();
    }
}

// A ball below a point of the table casts no shadow on it. Where it touches the point, the width of
// the penumbra is 0.1 mm on each side.
TEST(LampVisibility, OfAPointAtTheSurfaceOfABall) {
  const Vector3d p_m(-0.2, 0.1, 0), up = (kLamp_m - p_m).normalized();
  constexpr double kRadius_m = 0.02, kHalfWidth_m = 1e-4;
  for (const double gap_m : {-0.2e-3, -0.07e-3, 0.0, 0.05e-3, 0.2e-3}) {
    const Vector3d center_m = p_m - (kRadius_m + gap_m) * up;
    EXPECT_NEAR(lamp_visibility_past({center_m, center_m, kRadius_m}, p_m.cast<float>()),
                std::clamp(0.5 + 0.5 * gap_m / kHalfWidth_m, 0.0, 1.0),
                0.5 * kDistanceRounding_m / kHalfWidth_m)
        << gap_m;
  }
}

// The sleeve has no highlight, so its colour divided by the light is that of the texture.
Vector3f weave_at(const hull::Capsule& sleeve, const Vector3d& p_m) {
  const Vector3d segment = sleeve.b_world_m - sleeve.a_world_m;
  const double along =
      segment.isZero()
          ? 0
          : std::clamp((p_m - sleeve.a_world_m).dot(segment) / segment.squaredNorm(), 0.0, 1.0);
  const Vector3d normal = (p_m - sleeve.a_world_m - along * segment).normalized();
  return shaded({sleeve, Material::sleeve}, p_m, {0, -1, 1}) /
         brightness(p_m.cast<float>(), normal.cast<float>(), 1);
}
// Rounding of a colour of at most 200 levels by a few operations in float, and of a position of up
// to 0.3 m on a noise that changes by at most 1.5 * 16 levels per 1/300 m [levels].
constexpr double kColourRounding = 1e-3;

// The frame of a capsule: its axis, the horizontal direction across it, and the third one. Across a
// steep capsule is the direction that is also across the x axis.
Eigen::Matrix3d frame_of(const Vector3d& axis, bool is_steep) {
  Eigen::Matrix3d frame;
  frame.col(0) = axis;
  frame.col(1) = axis.cross(is_steep ? Vector3d::UnitX() : Vector3d::UnitZ()).normalized();
  frame.col(2) = axis.cross(frame.col(1));
  return frame;
}
struct Direction {
  Vector3d axis;
  bool is_steep;
};
const Direction kDirections[] = {{Vector3d(1, 0, 0), false},
                                 {Vector3d(0.3, 0.4, 0.88).normalized(), false},
                                 {Vector3d(0.3, -0.3, 0.92).normalized(), true},
                                 {Vector3d(0, 0, 1), true},
                                 {Vector3d(0, 0, -1), true}};

// Value noise between two points of its lattice is half of each in the middle. The weave is green
// and has 16 levels.
TEST(Shaded, TheWeaveOfASleeveIsNoiseOf300PerMetreInItsFrame) {
  constexpr double kWavelength_m = 1.0 / 300;
  constexpr int kPoints = 300;
  const Vector3d a_m(0.1, 0.2, 0.3);
  for (const auto& [axis, is_steep] : kDirections) {
    const Eigen::Matrix3d frame = frame_of(axis, is_steep);
    const hull::Capsule sleeve{a_m, a_m + 0.2 * axis, 0.04};
    float low = 1e9f, high = -1e9f;
    for (int i = 0; i < kPoints; ++i) {
      // On the lattice, 1.7 to 6 cm beside the axis.
      const Vector3d lattice(i % 60, 5 + i % 13, -3 - i % 7);
      const auto weave = [&](const Vector3d& place) {
        return weave_at(sleeve, a_m + kWavelength_m * (frame * place));
      };
      const Vector3f here = weave(lattice);
      EXPECT_NEAR(here[1] - here[0], 80, kColourRounding);
      EXPECT_NEAR(here[2] - here[0], -20, kColourRounding);
      low = std::min(low, here[0]), high = std::max(high, here[0]);
      for (int k = 0; k < 3; ++k)
        ASSERT_NEAR(weave(lattice + 0.5 * Vector3d::Unit(k))[0],
                    0.5 * (here[0] + weave(lattice + Vector3d::Unit(k))[0]), kColourRounding)
            << axis.transpose() << ": " << i << ' ' << k;
    }
    // Among 300 uniform numbers, one is below 0.05 and one above 0.95, except for one in 2e6.
    EXPECT_NEAR(low, 52.4, 0.4 + kColourRounding) << axis.transpose();
    EXPECT_NEAR(high, 67.6, 0.4 + kColourRounding) << axis.transpose();
  }
}

// The turn keeps the horizontal direction horizontal, or that across the x axis, and a steep
// capsule steep.
TEST(Shaded, TheWeaveOfASleeveMovesWithIt) {
  const Vector3d a_m(0.1, 0.2, 0.3), shift_m(-0.2, 0.1, 0.05);
  for (const auto& [axis, is_steep] : kDirections) {
    const Eigen::Matrix3d frame = frame_of(axis, is_steep);
    const hull::Capsule sleeve{a_m, a_m + 0.2 * axis, 0.04};
    const Eigen::Matrix3d turn =
        is_steep ? Eigen::AngleAxisd(-0.05, Vector3d::UnitX()).toRotationMatrix()
                 : Eigen::AngleAxisd(0.7, Vector3d::UnitZ()).toRotationMatrix();
    const auto moved = [&](const Vector3d& p_m) -> Vector3d { return turn * p_m + shift_m; };
    const hull::Capsule other{moved(sleeve.a_world_m), moved(sleeve.b_world_m), 0.04};
    for (int i = 0; i < 40; ++i) {
      const double angle_rad = 0.7 * i;
      const Vector3d p_m =
          a_m + frame * Vector3d(0.005 * i, 0.04 * std::cos(angle_rad), 0.04 * std::sin(angle_rad));
      const Vector3f before = weave_at(sleeve, p_m), after = weave_at(other, moved(p_m));
      for (int c = 0; c < 3; ++c)
        ASSERT_NEAR(after[c], before[c], kColourRounding) << axis.transpose() << ' ' << i;
    }
  }
}

// It has no axis, so its colour is that of one point of the weave.
TEST(Shaded, ABallOfSleeveHasOneColour) {
  const Vector3d a_m(0.1, 0.2, 0.3);
  const hull::Capsule ball{a_m, a_m, 0.04};
  const Vector3f first = weave_at(ball, a_m + Vector3d(0, 0, 0.04));
  EXPECT_NEAR(first[0], 60, 8 + kColourRounding);
  EXPECT_NEAR(first[1] - first[0], 80, kColourRounding);
  EXPECT_NEAR(first[2] - first[0], -20, kColourRounding);
  for (int i = 0; i < 40; ++i) {
    const Vector3d outwards(std::cos(0.7 * i), std::sin(0.7 * i), 0.1 * (i % 9 - 4));
    const Vector3f colour = weave_at(ball, a_m + 0.04 * outwards.normalized());
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(colour[c], first[c], kColourRounding) << i;
  }
}

// The direct light of the lamp is 0.4, the ambient light 0.62 from above and 0.7 of it from below.
TEST(Brightness, IsAmbientAndDirectLight) {
  const Vector3f above(0.5f, -0.35f, 0.9f);  // 1 m below the lamp
  EXPECT_NEAR(brightness(above, {0, 0, 1}, 1), 0.62 + 0.4, 1e-6);
  EXPECT_NEAR(brightness(above, {0, 0, 1}, 0.25f), 0.62 + 0.1, 1e-6);
  EXPECT_NEAR(brightness(above, {0, 0, -1}, 1), 0.62 * 0.7, 1e-6);
  EXPECT_NEAR(brightness(above, {0.8f, 0, 0.6f}, 1), 0.62 * (0.85 + 0.09) + 0.24, 1e-6);
}

TEST(Surroundings, ARayThatLeavesTheRoomShowsNoTexture) {
  const Surroundings& room = *test::test_room();
  const Vector3f edge_bgr(96, 92, 84);
  for (const auto& [origin_m, direction] : {std::pair{Vector3f(5, 0, 1), Vector3f(1, 0.1f, 0.1f)},
                                            {Vector3f(0, -4, 0.5f), Vector3f(0.1f, -1, -0.1f)},
                                            {Vector3f(0, 0, -2), Vector3f(0.1f, 0.2f, -1)},
                                            {Vector3f(0, 0, 1), Vector3f(0, 0, 0)}}) {
    const Surroundings::RayHit hit = room.trace_ray(origin_m, direction);
    EXPECT_EQ(hit.surface, Surface::other);
    EXPECT_EQ(hit.bgr, edge_bgr) << origin_m.transpose();
  }
}

// Each of 512 texels is about 1 cm of the floor. Between the centres of the texels the colour is
// linear; from the outermost centre to the wall it is constant.
TEST(Surroundings, TheFloorShowsItsOutermostTexels) {
  const Surroundings& room = *test::test_room();
  const Vector3f low(-2.9f, -2.7f, -0.75f), high(2.9f, 2.7f, 2.3f);
  for (const int axis : {0, 1})
    for (const bool at_end : {false, true}) {
      // The texture at a number of texels from the outermost centre.
      const auto texel_at = [&](double inwards, double across) {
        const double s = (inwards + 0.5) / 512;
        Vector3f p = low;
        p[axis] += float(at_end ? 1 - s : s) * (high[axis] - low[axis]);
        p[1 - axis] += float(across) * (high[1 - axis] - low[1 - axis]);
        const Vector3f eye = p + Vector3f(0, 0, 0.3f);
        const Surroundings::RayHit hit = room.trace_ray(eye, p - eye);
        EXPECT_EQ(hit.surface, Surface::floor);
        return double(hit.bgr[0] / brightness(p, Vector3f::UnitZ(), 1));
      };
      double steps = 0, bends = 0, outside = 0, halves = 0;
      constexpr int kPoints = 60;
      for (int i = 0; i < kPoints; ++i) {
        const double across = 0.02 + 0.96 * i / kPoints, first = texel_at(0, across),
                     second = texel_at(1, across), third = texel_at(2, across);
        steps += std::abs(second - first) / kPoints;
        bends += std::abs(first - 2 * second + third) / kPoints;
        outside += std::abs(texel_at(-0.4, across) - first) / kPoints;
        halves += std::abs(texel_at(0.5, across) - 0.5 * (first + second)) / kPoints;
      }
      SCOPED_TRACE(testing::Message() << axis << ' ' << at_end);
      EXPECT_GT(steps, 1);
      EXPECT_GT(bends, 1);
      EXPECT_LT(outside, 0.05);
      EXPECT_LT(halves, 0.05);
    }
}

}  // namespace
}  // namespace fivepipe::capture
