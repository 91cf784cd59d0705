// Motion from exact outlines without pixels, and the outlines of hull components.
#include <algorithm>
#include <functional>
#include <limits>

#include "common/collision/tracking/hull_components.h"
#include "common/collision/tracking/outline_motion.h"
#include "tests/support/collision_scene.h"

namespace fivepipe::test {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

// Corners of a board with random offsets.
std::vector<Vector3d> random_board(Random& random) {
  std::vector<Vector3d> points;
  for (int i = 0; i < 8; ++i)
    points.push_back(Vector3d(i & 1 ? 0.12 : -0.12, i & 2 ? 0.06 : -0.06, i & 4 ? 0.02 : -0.02) +
                     random_in_ball(random, 0.02));
  return points;
}

std::vector<Vector3d> circles(double radius_m, double half_m, int count) {
  std::vector<Vector3d> points;
  for (int i = 0; i < count; ++i) {
    const double a = 2 * std::numbers::pi * i / count;
    for (const double x : {-half_m, half_m})
      points.emplace_back(x, radius_m * std::cos(a), radius_m * std::sin(a));
  }
  return points;
}

struct Script {
  collision::UniformMotion motion;
  Vector3d center_m = kOrigin;
  std::vector<Vector3d> at(const std::vector<Vector3d>& points, double t_s) const {
    const Vector3d turn = t_s * motion.angular_velocity_world_rad_s;
    std::vector<Vector3d> moved;
    for (const Vector3d& p : points)
      moved.push_back(AngleAxisd(turn.norm(), turn.stableNormalized()) * p + center_m +
                      t_s * motion.velocity_world_m_s);
    return moved;
  }
};

// Exact outlines of the points' convex hull. Rays to interior points are never tangent.
std::deque<collision::OutlineSnapshot> outlines_of(const std::vector<Vector3d>& points,
                                                   const Script& script,
                                                   const std::vector<geometry::Camera>& cameras,
                                                   int frames) {
  std::deque<collision::OutlineSnapshot> seen;
  for (int i = 0; i < frames; ++i) {
    const double t_s = (i - 0.5 * (frames - 1)) / 60;
    collision::OutlineSnapshot at{
        100 + t_s, script.center_m + t_s * script.motion.velocity_world_m_s, {}};
    for (const geometry::Camera& camera : cameras) {
      collision::ComponentOutline outline{geometry::camera_center_world_m(camera), {}};
      for (const Vector3d& p : script.at(points, t_s))
        outline.corners_world.push_back(
            geometry::ray_through(camera, *geometry::project(camera, p)).direction_world);
      at.outlines.push_back(outline);
    }
    seen.push_back(at);
  }
  return seen;
}

Script random_script(Random& random, double speed_m_s, double rate_rad_s) {
  return {{speed_m_s * random_direction(random), rate_rad_s * random_direction(random)},
          random_in_ball(random, 0.1)};
}

TEST(OutlineMotion, IsExactForExactOutlines) {
  Random random(1);
  for (int scene = 0; scene < 100; ++scene) {
    const auto points = random_board(random);
    const Script script = random_script(random, uniform(random, 0.1, 2), uniform(random, 0.3, 6));
    const auto seen =
        outlines_of(points, script, ring(4 + scene % 3, 1.6, 0.5, 480, 1.1), 3 + scene % 10);
    const collision::UniformMotion guess{
        script.motion.velocity_world_m_s + 0.1 * random_direction(random),
        0.5 * script.motion.angular_velocity_world_rad_s};
    const auto found = collision::outline_motion(seen, guess, 0.08);
    ASSERT_TRUE(found) << scene;
    EXPECT_EQ(found->determined_axes, 3) << scene;
    // The last step rotates by less than 2 mrad over the window.
    const double window_s = seen.back().time_s - seen.front().time_s;
    EXPECT_LT(
        (found->motion.angular_velocity_world_rad_s - script.motion.angular_velocity_world_rad_s)
                .norm() *
            window_s,
        2e-3)
        << scene;
    EXPECT_LT(
        (found->motion.velocity_world_m_s - script.motion.velocity_world_m_s).norm() * window_s,
        1e-4)
        << scene;
    EXPECT_LT(found->residual_m, 1e-4) << scene;
  }
}

TEST(OutlineMotion, RotationOfRoundObjectsIsUndetermined) {
  Random random(2);
  for (int scene = 0; scene < 10; ++scene) {
    const Script script = random_script(random, 0.5, 3);
    const auto cameras = ring(5, 1.6, 0.5, 480, 1.1);
    std::vector<Vector3d> ball;
    for (const Vector3d& p : geometry::sphere_mesh(0.05, 3).vertices_m) ball.push_back(p);
    const auto of_ball = collision::outline_motion(
        outlines_of(ball, script, cameras, 6), {script.motion.velocity_world_m_s, kOrigin}, 0.04);
    ASSERT_TRUE(of_ball);
    EXPECT_EQ(of_ball->determined_axes, 0);
    EXPECT_EQ(of_ball->motion.angular_velocity_world_rad_s, kOrigin);
    const auto of_rod =
        collision::outline_motion(outlines_of(circles(0.02, 0.15, 64), script, cameras, 6),
                                  {script.motion.velocity_world_m_s, kOrigin}, 0.09);
    ASSERT_TRUE(of_rod);
    EXPECT_EQ(of_rod->determined_axes, 2);
    // No rotation about the rod's own axis, which is x at the centre of the window.
    EXPECT_LT(std::abs(of_rod->motion.angular_velocity_world_rad_s.x()), 0.05);
    EXPECT_LT(
        (of_rod->motion.angular_velocity_world_rad_s - script.motion.angular_velocity_world_rad_s)
            .tail<2>()
            .norm(),
        0.05 * 3);
  }
}

// Outlines of a perfect ball: circles on the cone that is tangent from the eye.
std::deque<collision::OutlineSnapshot> outlines_of_ball(
    double radius_m, const std::vector<geometry::Camera>& cameras, int frames,
    const std::function<Vector3d(double)>& center_m) {
  std::deque<collision::OutlineSnapshot> seen;
  for (int i = 0; i < frames; ++i) {
    const double t_s = (i - 0.5 * (frames - 1)) / 60;
    collision::OutlineSnapshot at{100 + t_s, center_m(t_s), {}};
    for (const geometry::Camera& camera : cameras) {
      collision::ComponentOutline outline{geometry::camera_center_world_m(camera), {}};
      const Vector3d to_center = at.centroid_world_m - outline.eye_world_m,
                     across = to_center.unitOrthogonal();
      const double tangent_m = std::sqrt(to_center.squaredNorm() - radius_m * radius_m),
                   sine = radius_m / to_center.norm();
      for (int k = 0; k < 200; ++k) {
        const Vector3d out =
            AngleAxisd(2 * std::numbers::pi * k / 200, to_center.normalized()) * across;
        outline.corners_world.push_back(
            tangent_m * (std::sqrt(1 - sine * sine) * to_center.normalized() + sine * out));
      }
      at.outlines.push_back(outline);
    }
    seen.push_back(at);
  }
  return seen;
}

TEST(OutlineMotion, WrongGuessGivesABallNoRotation) {
  Random random(5);
  const auto cameras = ring(6, 1.6, 0.5, 480, 1.1);
  for (const double error_m_s : {0.1, 0.2, 0.3, 0.5, 0.7, 1.0})
    for (const int frames : {6, 12, 20, 48}) {
      const Script script = random_script(random, 0.3, 0);
      const auto seen = outlines_of_ball(0.05, cameras, frames, [&](double t_s) {
        return Vector3d(script.center_m + t_s * script.motion.velocity_world_m_s);
      });
      const auto found = collision::outline_motion(
          seen, {script.motion.velocity_world_m_s + error_m_s * random_direction(random), kOrigin},
          0.04);
      ASSERT_TRUE(found) << error_m_s << " m/s, " << frames;
      EXPECT_EQ(found->determined_axes, 0) << error_m_s << " m/s, " << frames;
      EXPECT_EQ(found->motion.angular_velocity_world_rad_s, kOrigin);
      EXPECT_LT(found->residual_m, 1e-4) << error_m_s << " m/s, " << frames;
      EXPECT_LT((found->motion.velocity_world_m_s - script.motion.velocity_world_m_s).norm() *
                    (frames - 1) / 60,
                1e-4)
          << error_m_s << " m/s, " << frames;
    }
}

TEST(OutlineMotion, DeceleratingBallHasNoRotation) {
  const auto cameras = ring(6, 1.6, 0.5, 480, 1.1);
  for (const int frames : {8, 20, 48})
    for (const double stops_s :
         {-0.2, -0.1, -0.05, 0.0, 0.05, 0.1, 0.2}) {  // relative to the window's centre
      const auto seen = outlines_of_ball(0.05, cameras, frames, [&](double t_s) {
        return Vector3d(std::min(t_s - stops_s, 0.0), 0, 0);
      });
      for (const double guess_m_s : {0.0, 0.5, 1.0}) {
        const auto found =
            collision::outline_motion(seen, {guess_m_s * Vector3d::UnitX(), kOrigin}, 0.04);
        EXPECT_EQ(found ? found->determined_axes : 0, 0)
            << frames << " frames, stops at " << stops_s << ", guess " << guess_m_s;
      }
    }
}

TEST(OutlineMotion, StoppingBoardHasNoRotation) {
  Random random(6);
  const auto cameras = ring(6, 1.6, 0.5, 480, 1.1);
  int found_count = 0;
  for (int scene = 0; scene < 10; ++scene) {
    const auto points = random_board(random);
    const Script script = random_script(random, 1, 3);
    auto seen = outlines_of(points, script, cameras, 24);
    const auto stopped = seen[12];
    for (std::size_t i = 13; i < seen.size(); ++i)
      seen[i] = {seen[i].time_s, stopped.centroid_world_m, stopped.outlines};
    const auto found = collision::outline_motion(seen, script.motion, 0.08);
    if (!found) continue;
    ++found_count;
    EXPECT_EQ(found->determined_axes, 0) << scene;
    EXPECT_EQ(found->motion.angular_velocity_world_rad_s, kOrigin) << scene;
    EXPECT_GT(found->residual_m, 0.002) << scene;
  }
  EXPECT_GT(found_count, 0);
}

TEST(OutlineMotion, TooFewFramesOrCamerasGiveNoMotion) {
  Random random(3);
  const auto points = random_board(random);
  const Script script = random_script(random, 0.5, 2);
  EXPECT_FALSE(collision::outline_motion({}, {}, 0.08));
  EXPECT_FALSE(collision::outline_motion(outlines_of(points, script, {}, 6), {}, 0.08));
  EXPECT_FALSE(collision::outline_motion(
      outlines_of(points, script, ring(1, 1.6, 0.5, 480, 1.1), 6), {}, 0.08));
  const auto cameras = ring(5, 1.6, 0.5, 480, 1.1);
  EXPECT_FALSE(collision::outline_motion(outlines_of(points, script, cameras, 1), {}, 0.08));
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(collision::outline_motion(outlines_of(points, script, cameras, 6),
                                         {Vector3d::Constant(kNan), kOrigin}, 0.08));
  EXPECT_FALSE(collision::outline_motion(outlines_of(points, script, cameras, 6), {}, kNan));
}

std::vector<collision::HullComponent> components_of(
    const std::vector<hull::Silhouette>& silhouettes) {
  base::WorkerPool pool(1);
  hull::CpuHull hull(pool, silhouettes);
  return collision::hull_components(
      hull::HullQuery(hull),
      {{Vector3d(-0.5, -0.5, -0.4), Vector3d(0.5, 0.5, 0.4)}, 0.005, 20, true});
}

// The corners are object pixels, and no object pixel is outside the outline.
TEST(ComponentOutlines, ContainTheObjectPixels) {
  Random random(4);
  const auto silhouettes = silhouettes_of(random_object(random, 4), ring(4, 1.6, 0.6, 300, 1.1));
  const auto components = components_of(silhouettes);
  ASSERT_FALSE(components.empty());
  int seen = 0;
  for (const hull::Silhouette& s : silhouettes)
    for (const collision::ComponentOutline& outline : components[0].outlines) {
      if ((outline.eye_world_m - geometry::camera_center_world_m(s.camera)).norm() > 1e-9) continue;
      ++seen;
      std::vector<Eigen::Vector2d> corners;
      for (const Vector3d& ray : outline.corners_world)
        corners.push_back(*geometry::project(s.camera, outline.eye_world_m + ray));
      double outermost_px = -1e9, nearest = 1e9;
      for (int v = 0; v < 300; ++v)
        for (int u = 0; u < 300; ++u) {
          if (!s.pixels.contains(u, v)) continue;
          for (std::size_t i = 0; i < corners.size(); ++i) {
            const Eigen::Vector2d side = corners[(i + 1) % corners.size()] - corners[i],
                                  at = Eigen::Vector2d(u, v) - corners[i];
            outermost_px =
                std::max(outermost_px, (side.x() * at.y() - side.y() * at.x()) / side.norm());
            nearest = std::min(nearest, at.norm());
          }
        }
      EXPECT_NEAR(outermost_px, 0, 1e-6);  // pixels on the border, none beyond
      EXPECT_LT(nearest, 1e-6);
    }
  EXPECT_EQ(seen, 4);
}

TEST(ComponentOutlines, OverlappingOrClippedPiecesHaveNoOutline) {
  // The balls overlap in the first camera's image only.
  const std::vector<geometry::Camera> cameras = ring(5, 1.6, 0.3, 300, 1.1);
  const Vector3d to_center = geometry::camera_center_world_m(cameras[0]).normalized();
  const auto components = components_of(
      silhouettes_of({ball(-0.15 * to_center, 0.03), ball(0.15 * to_center, 0.03)}, cameras));
  ASSERT_EQ(components.size(), 2u);
  for (const collision::HullComponent& component : components) {
    EXPECT_EQ(component.outlines.size(), 4u);
    for (const collision::ComponentOutline& outline : component.outlines)
      EXPECT_GT((outline.eye_world_m - geometry::camera_center_world_m(cameras[0])).norm(), 0.1);
  }
  std::vector<geometry::Camera> narrow = cameras;
  narrow[2] = camera_at(geometry::camera_center_world_m(cameras[2]), 60,
                        0.1);  // sees the centre of the ball, clipped at the image border
  for (const collision::HullComponent& component :
       components_of(silhouettes_of({ball({0, 0, 0.03}, 0.04)}, narrow)))
    EXPECT_EQ(component.outlines.size(), 4u);
}

TEST(ComponentOutlines, PiecesOfTwoComponentsHaveNoOutline) {
  const Vector3d left(-0.1, 0, 0), right(0.1, 0, 0);
  base::WorkerPool pool(1);
  hull::CpuHull hull(
      pool, silhouettes_of({ball(left, 0.03), ball(right, 0.03)}, ring(4, 1.6, 1.2, 300, 1.1)));
  const hull::HullQuery query(hull);
  const std::vector<std::vector<Vector3d>> one{{left, right}}, two{{left}, {right}},
      shared{{left, right}, {right}};
  EXPECT_EQ(collision::component_outlines(query, one)[0].size(), 4u);
  for (const auto& outlines : collision::component_outlines(query, two))
    EXPECT_EQ(outlines.size(), 4u);
  for (const auto& outlines : collision::component_outlines(query, shared))
    EXPECT_TRUE(outlines.empty());
}

}  // namespace
}  // namespace fivepipe::test
