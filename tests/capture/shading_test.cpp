// The light, the shadow and the textures of the synthetic world, each at single points.
#include "capture_node/synthetic/shading.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "capture_node/synthetic/noise.h"
#include "tests/support/capture/capture_rig.h"

namespace fivepipe::capture {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

const Vector3d kLamp_m(0.5, -0.35, 1.9);

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
                    std::clamp(0.5 + 0.5 * clearance, 0.0, 1.0), 1e-3)
            << along << ' ' << clearance << ": " << (b_m - a_m).transpose();
    }
}

// A ball below a point of the table casts no shadow on it. Where it touches the point, the width of
// the penumbra is 0.1 mm on each side.
TEST(LampVisibility, OfAPointAtTheSurfaceOfABall) {
  const Vector3d p_m(-0.2, 0.1, 0), up = (kLamp_m - p_m).normalized();
  constexpr double kRadius_m = 0.02;
  for (const double gap_m : {-0.2e-3, -0.07e-3, 0.0, 0.05e-3, 0.2e-3}) {
    const Vector3d center_m = p_m - (kRadius_m + gap_m) * up;
    EXPECT_NEAR(lamp_visibility_past({center_m, center_m, kRadius_m}, p_m.cast<float>()),
                std::clamp(0.5 + 0.5 * gap_m / 1e-4, 0.0, 1.0), 2e-3)
        << gap_m;
  }
}

// The sleeve has no highlight, so its colour divided by the light is that of the texture: green
// with a weave of 1/300 m, in the frame of the axis and of the horizontal direction across it. That
// of a steep part is the direction across the x axis.
TEST(Shaded, TheWeaveOfASleeveFollowsItsAxis) {
  const Vector3d a_m(0.1, 0.2, 0.3), eye_m(0, -1, 1);
  for (const Vector3d& direction :
       {Vector3d(1, 0, 0), Vector3d(0.3, 0.4, 0.88), Vector3d(0.3, -0.3, 0.92), Vector3d(0, 0, 1),
        Vector3d(0, 0, -1), Vector3d(0, 0, 0)}) {
    const bool is_ball = direction.isZero();
    const Vector3d axis = is_ball ? direction : direction.normalized();
    const SyntheticPart part{{a_m, a_m + 0.2 * axis, 0.04}, Material::sleeve};
    const Vector3d side =
        axis.cross(std::abs(axis.z()) < 0.9 ? Vector3d::UnitZ() : Vector3d::UnitX()).normalized();
    for (int i = 0; i < 40; ++i) {
      const double turn = 0.7 * i;
      const Vector3d across =
          is_ball ? Vector3d(std::cos(turn), std::sin(turn), 0)
                  : Vector3d(std::cos(turn) * side + std::sin(turn) * axis.cross(side));
      const double along_m = 0.005 * i;
      const Vector3d p_m = a_m + (is_ball ? 0.0 : along_m) * axis + 0.04 * across;
      const Vector3d from_a = p_m - a_m;
      const double weave =
          value_noise(29, float(300 * from_a.dot(axis)), float(300 * from_a.dot(side)),
                      float(300 * from_a.dot(axis.cross(side))));
      const Vector3f expected = Vector3f(60, 140, 40) + Vector3f::Constant(float(16 * weave - 8));
      const float light = brightness(p_m.cast<float>(), across.cast<float>(), 1);
      const Vector3f found = shaded(part, p_m, eye_m) / light;
      for (int c = 0; c < 3; ++c)
        ASSERT_NEAR(found[c], expected[c], 0.05) << direction.transpose() << " at " << i;
    }
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
