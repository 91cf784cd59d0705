#include "common/hull/silhouette_bounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

namespace fivepipe::hull {
namespace {

using Vector3d = Eigen::Vector3d;
constexpr double kNearest_m = 0.01;

const Eigen::AlignedBox3d kBox(Vector3d(-1, -1, -0.5), Vector3d(1, 1, 1.5));

Vector3d random_in(const Eigen::AlignedBox3d& box, std::mt19937& random) {
  std::uniform_real_distribution<double> share(0, 1);
  return box.min() +
         Vector3d{share(random), share(random), share(random)}.cwiseProduct(box.sizes());
}

bool is_in(const SilhouetteBounds& seen, const Vector3d& p_m, double slack_px) {
  const auto uv = geometry::project(seen.camera, p_m);
  return uv && (seen.camera.camera_from_world * p_m).z() >= kNearest_m &&
         uv->x() >= seen.part.u0_px - 0.5 - slack_px &&
         uv->x() < seen.part.u1_px - 0.5 + slack_px &&
         uv->y() >= seen.part.v0_px - 0.5 - slack_px && uv->y() < seen.part.v1_px - 0.5 + slack_px;
}

double support(const std::vector<Vector3d>& points, const Vector3d& direction) {
  double extent = -std::numeric_limits<double>::infinity();
  for (const Vector3d& p : points) extent = std::max(extent, direction.dot(p));
  return extent;
}

std::vector<SilhouetteBounds> random_parts(int count, std::mt19937& random) {
  std::vector<SilhouetteBounds> parts;
  std::uniform_int_distribution<int> column(0, 719), row(0, 485);
  while (int(parts.size()) < count) {
    const Vector3d eye_m =
        2.5 * random_in({Vector3d(-1, -1, 0.2), Vector3d(1, 1, 1)}, random).normalized();
    int u0 = column(random), u1 = column(random), v0 = row(random), v1 = row(random);
    if (u0 > u1) std::swap(u0, u1);
    if (v0 > v1) std::swap(v0, v1);
    parts.push_back(
        {{geometry::pinhole_from_fov(720, 486, 1.0), geometry::look_at(eye_m, {0, 0, 0.3})},
         {u0, v0, u1 + 1, v1 + 1}});
  }
  return parts;
}

TEST(HullBounds, WithoutRectsEqualTheBox) {
  const auto corners = corners_around_hull({}, kBox, kNearest_m);
  Eigen::AlignedBox3d found;
  for (const Vector3d& corner : corners) found.extend(corner);
  EXPECT_TRUE(found.isApprox(kBox, 1e-12));
}

// In every direction the corners extend at least as far as each point that is in all rects, and
// every corner that is not nearest_m from a camera is in all rects widened by 0.01 px.
TEST(HullBounds, ContainEveryPointSeenInAllRects) {
  std::mt19937 random(7);
  int held = 0;
  for (int round = 0; round < 60; ++round) {
    const auto parts = random_parts(1 + round % 5, random);
    const auto corners = corners_around_hull(parts, kBox, kNearest_m);
    std::vector<Vector3d> inside;
    for (int i = 0; i < 2000; ++i)
      if (const Vector3d p = random_in(kBox, random);
          std::all_of(parts.begin(), parts.end(),
                      [&](const SilhouetteBounds& seen) { return is_in(seen, p, 0); }))
        inside.push_back(p);
    held += int(inside.size());
    for (int i = 0; i < 100 && !inside.empty(); ++i) {
      const Vector3d direction = Vector3d::Random().normalized();
      ASSERT_GE(support(corners, direction), support(inside, direction)) << round;
    }
    for (const Vector3d& corner : corners) {
      EXPECT_LT(kBox.exteriorDistance(corner), 1e-9);
      for (const SilhouetteBounds& seen : parts)
        if ((seen.camera.camera_from_world * corner).z() > kNearest_m + 1e-6) {
          EXPECT_TRUE(is_in(seen, corner, 0.01 + 1e-6)) << round;
        }
    }
  }
  EXPECT_GT(held, 1000);
}

// Points exactly on the border of a rect.
TEST(HullBounds, ContainPointsOnARectsBorder) {
  std::mt19937 random(5);
  for (int round = 0; round < 100; ++round) {
    const auto parts = random_parts(1, random);
    const geometry::Camera& camera = parts[0].camera;
    const PixelRect& r = parts[0].part;
    const auto corners = corners_around_hull(parts, kBox, kNearest_m);
    for (const double u : {r.u0_px - 0.5, r.u1_px - 0.5})
      for (const double v : {r.v0_px - 0.5, r.v1_px - 0.5}) {
        const geometry::Ray ray = geometry::ray_through(camera, {u, v});
        const Vector3d p = ray.origin_world_m + 2.4 * ray.direction_world;
        if (!kBox.contains(p)) continue;
        // Perpendicular to the face of the rect's pyramid that holds p, outward.
        const double outwards = u < r.u0_px ? -1 : 1;
        const Vector3d across =
            camera.camera_from_world.linear().transpose() *
            (outwards * Vector3d(camera.pinhole.fx_px, 0, camera.pinhole.cx_px - u));
        ASSERT_GT(support(corners, across), across.dot(p)) << round;
      }
  }
}

TEST(HullBounds, EndInFrontOfEachCamera) {
  std::mt19937 random(9);
  for (int round = 0; round < 100; ++round) {
    auto parts = random_parts(2, random);
    parts[0].camera.camera_from_world =
        geometry::look_at(0.5 * random_in(kBox, random), {0.01, 0.02, 0.3});  // inside the box
    for (const Vector3d& corner : corners_around_hull(parts, kBox, kNearest_m))
      for (const SilhouetteBounds& seen : parts)
        EXPECT_GT((seen.camera.camera_from_world * corner).z(), kNearest_m - 1e-9) << round;
  }
}

TEST(HullBounds, AreIndependentOfOrder) {
  std::mt19937 random(3);
  auto parts = random_parts(4, random);
  for (SilhouetteBounds& seen : parts) seen.part = {100, 80, 600, 420};
  const auto once = corners_around_hull(parts, kBox, kNearest_m);
  ASSERT_FALSE(once.empty());
  parts.push_back(parts.front());  // the same rect twice
  std::shuffle(parts.begin(), parts.end(), random);
  const auto again = corners_around_hull(parts, kBox, kNearest_m);
  for (int i = 0; i < 100; ++i) {
    const Vector3d direction = Vector3d::Random().normalized();
    EXPECT_NEAR(support(once, direction), support(again, direction), 1e-9);
  }
}

// A camera at distance 2 sees a rect of 100 x 80 px in the middle of the box. The cut of its
// pyramid with the box's far side is the rect and 0.01 px more on each side, times depth and focal
// length.
TEST(HullBounds, WidenARectByAHundredthOfAPixel) {
  const geometry::Camera camera{{200, 160, 100, 50, 99.5, 79.5}, Eigen::Isometry3d::Identity()};
  const Eigen::AlignedBox3d box(Vector3d(-3, -3, 1), Vector3d(3, 3, 2));
  const auto corners = corners_around_hull(
      std::vector<SilhouetteBounds>{{camera, {50, 40, 150, 120}}}, box, kNearest_m);
  const double wide_m = 2 * 50.01 / 100, high_m = 2 * 40.01 / 50;
  EXPECT_NEAR(support(corners, {1, 0, 0}), wide_m, 1e-12);
  EXPECT_NEAR(support(corners, {-1, 0, 0}), wide_m, 1e-12);
  EXPECT_NEAR(support(corners, {0, 1, 0}), high_m, 1e-12);
  EXPECT_NEAR(support(corners, {0, -1, 0}), high_m, 1e-12);
  EXPECT_NEAR(support(corners, {0, 0, 1}), 2, 1e-12);
  EXPECT_NEAR(support(corners, {0, 0, -1}), -1, 1e-12);
  EXPECT_NEAR(support(corners, {1, 0, -1}), 50.01 / 100 - 1, 1e-12);
}

TEST(HullBounds, AreEmptyForDisjointRects) {
  const geometry::Camera left{geometry::pinhole_from_fov(720, 486, 1.0),
                              geometry::look_at({-2, 0, 0.5}, {0, 0, 0.5})},
      right{left.pinhole, geometry::look_at({2, 0, 0.5}, {0, 0, 0.5})};
  const std::vector<SilhouetteBounds> top_and_bottom = {{left, {300, 0, 400, 50}},
                                                        {right, {300, 436, 400, 486}}};
  EXPECT_TRUE(corners_around_hull(top_and_bottom, kBox, kNearest_m).empty());
  const geometry::Camera away{left.pinhole, geometry::look_at({-2, 0, 0.5}, {-4, 0, 0.5})};
  EXPECT_TRUE(
      corners_around_hull(std::vector<SilhouetteBounds>{{away, {0, 0, 720, 486}}}, kBox, kNearest_m)
          .empty());
}

// One pixel of each of two cameras: the body is 1 mm wide and not empty.
TEST(HullBounds, OfOnePixelEachContainItsPoint) {
  const Vector3d p(0.21, -0.13, 0.4);
  std::vector<SilhouetteBounds> parts;
  for (const Vector3d& eye_m : {Vector3d(-2, 0.3, 1), Vector3d(0.1, -2, 1.2)}) {
    const geometry::Camera camera{geometry::pinhole_from_fov(720, 486, 1.0),
                                  geometry::look_at(eye_m, {0, 0, 0.3})};
    const auto uv = geometry::project(camera, p);
    const int u = int(std::lround(uv->x())), v = int(std::lround(uv->y()));
    parts.push_back({camera, {u, v, u + 1, v + 1}});
  }
  const auto corners = corners_around_hull(parts, kBox, kNearest_m);
  ASSERT_FALSE(corners.empty());
  for (const Vector3d& corner : corners) EXPECT_LT((corner - p).norm(), 0.05);
}

}  // namespace
}  // namespace fivepipe::hull
