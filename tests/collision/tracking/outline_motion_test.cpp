// Motion from exact outlines without pixels, and the outlines of hull components.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include "common/collision/tracking/hull_components.h"
#include "common/collision/tracking/outline_motion.h"
#include "tests/support/collision/scene.h"
#include "tests/support/not_finite.h"

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
    const double speed_m_s = uniform(random, 0.1, 2), rate_rad_s = uniform(random, 0.3, 6);
    const Script script = random_script(random, speed_m_s, rate_rad_s);
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
  EXPECT_FALSE(collision::outline_motion(outlines_of(points, script, cameras, 6),
                                         {Vector3d::Constant(kNaN), kOrigin}, 0.08));
  EXPECT_FALSE(collision::outline_motion(outlines_of(points, script, cameras, 6), {}, kNaN));
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

// Label of each object pixel: 8-connected pieces, by flood fill; -1 for the other pixels.
std::vector<int> pieces_of(const hull::ObjectPixels& pixels) {
  const int width = pixels.width_px(), height = pixels.height_px();
  std::vector<int> piece(std::size_t(width) * std::size_t(height), -1);
  int count = 0;
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) {
      if (!pixels.contains(u, v) || piece[std::size_t(v * width + u)] >= 0) continue;
      std::vector<std::pair<int, int>> open{{u, v}};
      while (!open.empty()) {
        const auto [x, y] = open.back();
        open.pop_back();
        if (!pixels.contains(x, y) || piece[std::size_t(y * width + x)] >= 0) continue;
        piece[std::size_t(y * width + x)] = count;
        for (int n = 0; n < 9; ++n) open.emplace_back(x + n % 3 - 1, y + n / 3 - 1);
      }
      ++count;
    }
  return piece;
}

using PixelSet = std::set<std::pair<int, int>>;
// The corners of the convex hull: pixels p with a direction in which p alone is outermost, which is
// so if every pixel is on one side of a line through p, within less than half a turn.
PixelSet corners_of(const std::vector<std::pair<int, int>>& pixels) {
  PixelSet corners;
  for (const auto& p : pixels) {
    std::vector<double> angles;
    for (const auto& q : pixels)
      if (q != p) angles.push_back(std::atan2(q.second - p.second, q.first - p.first));
    std::sort(angles.begin(), angles.end());
    double widest = angles.empty() ? 7 : angles.front() + 2 * std::numbers::pi - angles.back();
    for (std::size_t i = 1; i < angles.size(); ++i)
      widest = std::max(widest, angles[i] - angles[i - 1]);
    if (widest > std::numbers::pi + 1e-6) corners.insert(p);
  }
  return corners.size() < 3 ? PixelSet{} : corners;
}

// One camera with scattered pixels; points on the rays of random pixels belong to three components.
TEST(ComponentOutlines, EqualTheConvexHullsOfTheirPieces) {
  Random random(7);
  int with_outline = 0, without = 0;
  for (int scene = 0; scene < 150; ++scene) {
    const geometry::Camera camera = random_camera(random, 45, 31);
    const hull::ObjectPixels pixels =
        random_pixels(random, 45, 31, std::array{0.05, 0.12, 0.2, 0.3}[std::size_t(scene % 4)]);
    base::WorkerPool pool(1);
    const std::vector<hull::Silhouette> silhouettes{{camera, pixels}};
    hull::CpuHull hull(pool, silhouettes);
    std::vector<std::vector<Vector3d>> points(3);
    const std::vector<int> piece = pieces_of(pixels);
    std::vector<std::set<int>> owned(3);
    for (int i = 0; i < 3 + scene % 9; ++i) {
      const int u = int(uniform(random, 0, 45)), v = int(uniform(random, 0, 31));
      const geometry::Ray ray = geometry::ray_through(
          camera, {u + uniform(random, -0.49, 0.49), v + uniform(random, -0.49, 0.49)});
      const auto component = std::size_t(i % 3);
      points[component].push_back(ray.origin_world_m +
                                  uniform(random, 0.5, 2) * ray.direction_world);
      if (pixels.contains(u, v)) owned[component].insert(piece[std::size_t(v * 45 + u)]);
    }
    points[0].push_back(geometry::camera_center_world_m(camera) -
                        geometry::ray_through(camera, {20, 15}).direction_world);  // behind it
    const auto outlines = collision::component_outlines(hull::HullQuery(hull), points);
    ASSERT_EQ(outlines.size(), 3u);
    for (std::size_t component = 0; component < 3; ++component) {
      bool is_clear = true;
      std::vector<std::pair<int, int>> own;
      for (int v = 0; v < 31; ++v)
        for (int u = 0; u < 45; ++u) {
          const int label = piece[std::size_t(v * 45 + u)];
          if (label < 0 || !owned[component].contains(label)) continue;
          own.emplace_back(u, v);
          is_clear &= u > 0 && u < 44 && v > 0 && v < 30;
          for (std::size_t other = 0; other < 3; ++other)
            is_clear &= other == component || !owned[other].contains(label);
        }
      const PixelSet expected = is_clear ? corners_of(own) : PixelSet{};
      PixelSet found;
      for (const collision::ComponentOutline& outline : outlines[component]) {
        EXPECT_LT((outline.eye_world_m - geometry::camera_center_world_m(camera)).norm(), 1e-12);
        for (const Vector3d& ray : outline.corners_world) {
          const Eigen::Vector2d uv = *geometry::project(camera, outline.eye_world_m + ray);
          EXPECT_TRUE(found.emplace(std::lround(uv.x()), std::lround(uv.y())).second);
        }
      }
      EXPECT_EQ(outlines[component].size(), expected.empty() ? 0u : 1u) << scene;
      EXPECT_EQ(found, expected) << scene << ' ' << component;
      ++(expected.empty() ? without : with_outline);
    }
  }
  EXPECT_GT(with_outline, 40);
  EXPECT_GT(without, 100);
}

// Outlines whose corners are off by up to half a milliradian, so that each step of the fit, each
// pair of cameras and each limit changes the result. The values are those of this method; no other
// one gives them.
TEST(OutlineMotion, FitsOfDisturbedOutlinesKeepTheirValues) {
  struct Case {
    int cameras, frames;
    double speed_m_s, rate_rad_s, size_m, disturbance;
    double velocity_m_s[3], turn_rad_s[3];
    int axes;
    double residual_m;
  };
  const Case cases[] = {
      {3,
       6,
       0.5,
       1,
       0.08,
       5e-4,
       {-0.0937929692019, -0.468545559556, -0.0756281515505},
       {-0.132381756601, 0.845619199419, -0.127335631583},
       2,
       0.000464928599691},
      {5,
       9,
       1,
       3,
       0.05,
       5e-4,
       {-0.0547543638957, -0.74939602062, -0.659373679143},
       {1.93110377527, 2.17779323883, 0.692966203173},
       3,
       0.000669966336335},
      {8,
       20,
       0.3,
       2,
       0.06,
       1e-3,
       {0.202103036352, 0.20345928666, 0.0926875276252},
       {1.84623784641, 0.204659368804, 0.745374976549},
       3,
       0.00126947073432},
      {12,
       24,
       0.5,
       3,
       0.08,
       1e-3,
       {0.113001150976, -0.486620770513, 0.0103930315906},
       {-0.578208493845, -2.94372095934, -0.0309155758197},
       3,
       0.00136378747677},
      {20,
       33,
       0.4,
       1,
       0.045,
       2e-3,
       {0.169724150614, 0.358911213422, 0.030477664124},
       {0, 0, 0},
       0,
       0.0101213834252},
      {6,
       12,
       2,
       9,
       0.08,
       1e-3,
       {-0.205339109568, 1.73694031218, 0.967971695132},
       {-4.72140585824, 7.44586496225, -1.83106515707},
       3,
       0.00128969130588},
      {4,
       7,
       1,
       3,
       0.05,
       1e-3,
       {0.022925690186, -0.944411291354, 0.313475649812},
       {-0.13221942966, -1.69142176093, 2.35650011406},
       3,
       0.00120006505784},
  };
  int number = 0;
  for (const Case& c : cases) {
    Random random(std::uint64_t(100 + number));
    const auto points = random_board(random);
    const Script script = random_script(random, c.speed_m_s, c.rate_rad_s);
    std::vector<geometry::Camera> cameras = ring(c.cameras, 1.3, 0.5, 480, 1.1);
    for (std::size_t i = 1; i < cameras.size(); i += 2)
      cameras[i] = ring(c.cameras, 1.9, 0.1, 480, 1.1)[i];
    auto seen = outlines_of(points, script, cameras, c.frames);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      seen[i].centroid_world_m += 0.002 * random_direction(random);
      if (i % 4 == 1) seen[i].outlines.pop_back();
      for (collision::ComponentOutline& outline : seen[i].outlines)
        for (Vector3d& ray : outline.corners_world) ray += c.disturbance * random_direction(random);
    }
    const auto found = collision::outline_motion(
        seen,
        {script.motion.velocity_world_m_s + 0.2 * random_direction(random),
         0.5 * script.motion.angular_velocity_world_rad_s},
        c.size_m);
    ASSERT_TRUE(found) << number;
    const Vector3d velocity(c.velocity_m_s), turn(c.turn_rad_s);
    const Vector3d &v = found->motion.velocity_world_m_s,
                   &w = found->motion.angular_velocity_world_rad_s;
    EXPECT_LT((v - velocity).norm(), 1e-9) << number;
    EXPECT_LT((w - turn).norm(), 1e-9) << number;
    EXPECT_EQ(found->determined_axes, c.axes) << number;
    EXPECT_NEAR(found->residual_m, c.residual_m, 1e-11) << number;
    ++number;
  }
}

}  // namespace
}  // namespace fivepipe::test
