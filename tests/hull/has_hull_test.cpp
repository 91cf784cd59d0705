// Whether silhouettes have a common point.
#include "common/hull/cpu/has_hull.h"

#include <gtest/gtest.h>

#include <numbers>

namespace fivepipe::hull {
namespace {

constexpr int kWidth_px = 160, kHeight_px = 120;

// A camera on a circle of 2 m around the origin with object pixels in this rectangle.
Silhouette seen_from(double angle, const PixelRect& object) {
  Silhouette seen{{geometry::pinhole_from_fov(kWidth_px, kHeight_px, 0.8),
                   geometry::look_at({2 * std::cos(angle), 2 * std::sin(angle), 0}, {0, 0, 0})},
                  {kWidth_px, kHeight_px}};
  for (int v = object.v0_px; v < object.v1_px; ++v)
    seen.pixels.set_run(object.u0_px, object.u1_px, v);
  return seen;
}
constexpr PixelRect kMiddle{70, 50, 90, 70}, kTop{70, 5, 90, 25}, kBottom{70, 95, 90, 115};

bool has_hull(const std::vector<Silhouette>& silhouettes, const HullRule& rule = {}) {
  base::WorkerPool pool(1);
  CpuHull hull(pool, silhouettes, rule);
  return has_hull(hull, silhouettes);
}

TEST(HasHull, NeedsACommonPoint) {
  const double third = 2 * std::numbers::pi / 3;
  EXPECT_TRUE(has_hull({seen_from(0, kMiddle), seen_from(third, kMiddle)}));
  EXPECT_TRUE(
      has_hull({seen_from(0, kMiddle), seen_from(third, kMiddle), seen_from(-third, kMiddle)}));
  EXPECT_FALSE(has_hull({seen_from(0, kTop), seen_from(third, kBottom)})) << "above and below";
  EXPECT_FALSE(
      has_hull({seen_from(0, kMiddle), seen_from(third, kMiddle), seen_from(-third, kTop)}));
  EXPECT_FALSE(has_hull({}));
  EXPECT_FALSE(has_hull({seen_from(0, kMiddle), seen_from(third, {})})) << "nothing in one";
}

TEST(HasHull, IsThatInsideTheVolume) {
  const std::vector<Silhouette> silhouettes{seen_from(0, kMiddle), seen_from(1, kMiddle)};
  HullRule rule;
  rule.within_world_m = {Eigen::Vector3d(-0.5, -0.5, -0.5), Eigen::Vector3d(0.5, 0.5, 0.5)};
  EXPECT_TRUE(has_hull(silhouettes, rule));
  rule.within_world_m = {Eigen::Vector3d(-0.5, -0.5, 0.3), Eigen::Vector3d(0.5, 0.5, 0.5)};
  EXPECT_FALSE(has_hull(silhouettes, rule));
}

TEST(HasHull, FindsAHullOfOnePixel) {
  for (const int u : {70, 71, 72, 73})
    EXPECT_TRUE(has_hull({seen_from(0, {u, 50, u + 1, 70}), seen_from(1, kMiddle)})) << u;
}

}  // namespace
}  // namespace fivepipe::hull
