// Bounds of the distance to the hull: never broken, and no wider than asked for.
#include "common/collision/proximity/proximity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "common/collision/proximity/lazy_octree.h"
#include "common/hull/oracle/reference.h"
#include "tests/support/hull_queries.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

constexpr double kRounding_m =
    1e-9;  // of distances of a metre, and of the sliver's bound in proximity_shapes.h

std::vector<collision::Proximity> of_points(const hull::HullQuery& query,
                                            const collision::ProximityOptions& options,
                                            std::span<const Vector3d> points) {
  std::vector<collision::Proximity> found(points.size());
  collision::HullProximity(query, options).of_points(points, found);
  return found;
}
std::vector<collision::Proximity> of_triangles(const hull::HullQuery& query,
                                               const collision::ProximityOptions& options,
                                               std::span<const collision::Triangle> triangles) {
  std::vector<collision::Proximity> found(triangles.size());
  collision::HullProximity(query, options).of_triangles(triangles, found);
  return found;
}

// As near to each other as asked for, where the cap doesn't end it.
bool told(const collision::Proximity& p, const collision::ProximityOptions& options) {
  return p.min_m >= options.cap_m || p.max_m - p.min_m <= options.tolerance_m + kRounding_m;
}

geometry::Camera looking(const Vector3d& eye_m, int width_px, int height_px, double fov_rad) {
  return {geometry::pinhole_from_fov(width_px, height_px, fov_rad),
          geometry::look_at(
              eye_m, Vector3d::Zero(),
              std::abs(eye_m.normalized().z()) > 0.9 ? Vector3d::UnitX() : Vector3d::UnitZ())};
}

// A palm and two fingers, seen by three or more cameras.
std::vector<hull::Silhouette> hand(int cameras = 3) {
  const std::vector<hull::Capsule> object = {{{-0.08, 0, 0}, {0.01, 0.01, 0.02}, 0.03},
                                             {{0.02, 0.01, 0.02}, {0.09, 0.03, 0.02}, 0.008},
                                             {{0.02, -0.01, 0.02}, {0.09, -0.03, 0}, 0.007}};
  std::vector<geometry::Camera> rig;
  const Vector3d eyes_m[] = {{1, 0.2, 0.7}, {-0.5, 0.9, 0.6}, {-0.4, -1, 0.5}, {0.1, 0.1, -1.2}};
  for (int i = 0; i < cameras; ++i) rig.push_back(looking(eyes_m[i], 240, 180, 0.4));
  return silhouettes_of(object, rig);
}

std::vector<Vector3d> random_points(Random& random, int count, double radius_m) {
  std::vector<Vector3d> points;
  for (int i = 0; i < count; ++i) points.push_back(random_in_ball(random, radius_m));
  return points;
}

collision::Triangle random_triangle(Random& random, double center_m, double size_m) {
  const Vector3d middle = random_in_ball(random, center_m);
  return {middle + random_in_ball(random, size_m), middle + random_in_ball(random, size_m),
          middle + random_in_ball(random, size_m)};
}

// --- closed form: maps that are rectangles make a convex hull of planes

struct Plane {
  Vector3d normal;  // unit, out of the hull
  double at_m;      // along it
};

struct Wedge {
  std::vector<hull::Silhouette> silhouettes;
  std::vector<Plane> planes;
};

Wedge random_wedge(Random& random, int cameras) {
  Wedge wedge;
  for (int i = 0; i < cameras; ++i) {
    const geometry::Camera camera =
        looking(uniform(random, 0.6, 1.2) * random_direction(random), 160, 121, 0.6);
    hull::ObjectPixels pixels(160, 121);
    const int u0 = int(uniform(random, 30, 75)), u1 = int(uniform(random, 85, 130)),
              v0 = int(uniform(random, 20, 55)), v1 = int(uniform(random, 66, 100));
    for (int v = v0; v < v1; ++v)
      for (int u = u0; u < u1; ++u) pixels.set(u, v);
    wedge.silhouettes.push_back({camera, pixels});
    const Vector3d eye_m = geometry::camera_center_world_m(camera);
    const auto corner = [&](double u_px, double v_px) {
      return Vector3d(geometry::ray_through(camera, {u_px - 0.5, v_px - 0.5}).direction_world);
    };
    const Vector3d around[] = {corner(u0, v0), corner(u1, v0), corner(u1, v1), corner(u0, v1)};
    for (int k = 0; k < 4; ++k) {
      Vector3d normal = around[k].cross(around[(k + 1) % 4]).normalized();
      if (normal.dot(around[(k + 2) % 4]) > 0) normal = -normal;
      wedge.planes.push_back({normal, normal.dot(eye_m)});
    }
  }
  return wedge;
}

// The nearest point of the convex hull lies on some face, edge or corner: of the projections onto
// those that are in the hull, the nearest.
class WedgeDistance {
 public:
  explicit WedgeDistance(const std::vector<Plane>& planes) : planes_(planes) {
    for (std::size_t i = 0; i < planes.size(); ++i) {
      add({i});
      for (std::size_t j = i + 1; j < planes.size(); ++j) {
        add({i, j});
        for (std::size_t k = j + 1; k < planes.size(); ++k) add({i, j, k});
      }
    }
  }
  double operator()(const Vector3d& p) const {
    if (in_all(p)) return 0;
    double nearest_m = kInfinity;
    for (const Part& part : parts_) {
      const Vector3d q = p - part.towards * (part.normals * p - part.at_m);
      const double to_m = (q - p).norm();
      if (to_m < nearest_m && in_all(q)) nearest_m = to_m;
    }
    return nearest_m;
  }

 private:
  struct Part {  // rows of the planes on which it lies; the others are 0
    Eigen::Matrix3d normals = Eigen::Matrix3d::Zero(), towards;
    Vector3d at_m = Vector3d::Zero();
  };
  void add(std::initializer_list<std::size_t> on) {
    Part part;
    Eigen::Index row = 0;
    for (const std::size_t i : on) {
      part.normals.row(row) = planes_[i].normal.transpose();
      part.at_m[row++] = planes_[i].at_m;
    }
    part.towards = part.normals.completeOrthogonalDecomposition().pseudoInverse();
    parts_.push_back(part);
  }
  bool in_all(const Vector3d& q) const {
    constexpr double kOnPlane_m = 1e-10;  // rounding of a projection
    return std::all_of(planes_.begin(), planes_.end(), [&](const Plane& plane) {
      return plane.normal.dot(q) <= plane.at_m + kOnPlane_m;
    });
  }
  std::vector<Plane> planes_;
  std::vector<Part> parts_;
};

TEST(Proximity, BoundsTheDistanceToAWedgeOfPlanes) {
  constexpr collision::ProximityOptions kOptions{0.15, 0.001};
  int below_cap = 0, beyond = 0, inside = 0;
  for (int seed = 1; seed <= 24; ++seed) {
    Random random(seed);
    const Wedge wedge = random_wedge(random, 1 + seed % 3);
    const WedgeDistance distance_m(wedge.planes);
    const Queries q(wedge.silhouettes);
    const auto points = random_points(random, 80, 0.35);
    const auto found = of_points(q.query, kOptions, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double true_m = distance_m(points[i]);
      ASSERT_LE(found[i].min_m, true_m + kRounding_m)
          << "seed " << seed << " at " << points[i].transpose();
      ASSERT_GE(found[i].max_m, true_m - kRounding_m)
          << "seed " << seed << " at " << points[i].transpose();
      if (true_m > kRounding_m && true_m < kOptions.cap_m) {
        ASSERT_TRUE(told(found[i], kOptions)) << "seed " << seed << " at " << points[i].transpose();
        ++below_cap;
      }
      if (true_m > kOptions.cap_m + kOptions.tolerance_m) {
        ASSERT_EQ(found[i], (collision::Proximity{kOptions.cap_m, kInfinity}));
        ++beyond;
      }
      inside += found[i] == collision::Proximity{0, 0};
    }
  }
  EXPECT_GT(below_cap, 400);
  EXPECT_GT(beyond, 150);
  EXPECT_GT(inside, 100);
}

TEST(Proximity, BoundsTheDistanceOfTrianglesToAWedgeOfPlanes) {
  constexpr collision::ProximityOptions kOptions{0.1, 0.001};
  int below_cap = 0;
  for (int seed = 1; seed <= 10; ++seed) {
    Random random(seed);
    const Wedge wedge = random_wedge(random, 2);
    const WedgeDistance distance_m(wedge.planes);
    const Queries q(wedge.silhouettes);
    for (int i = 0; i < 20; ++i) {
      const collision::Triangle triangle = random_triangle(random, 0.25, i % 2 ? 0.02 : 0.3);
      const collision::Proximity found = of_triangles(q.query, kOptions, std::vector{triangle})[0];
      // Sampled, the distance is at most half a sample's spacing too large: the distance changes by
      // no more than one moves.
      constexpr int kSamples = 16;
      const collision::TriangleView view = collision::view_of(triangle);
      const double longest_m = (view.base1_world_m - view.base0_world_m).norm();
      double sampled_m = kInfinity;
      for (int a = 0; a <= kSamples; ++a)
        for (int b = 0; a + b <= kSamples; ++b)
          sampled_m =
              std::min(sampled_m,
                       distance_m(triangle[0] + double(a) / kSamples * (triangle[1] - triangle[0]) +
                                  double(b) / kSamples * (triangle[2] - triangle[0])));
      ASSERT_LE(found.min_m, sampled_m + kRounding_m) << "seed " << seed << " triangle " << i;
      ASSERT_GE(found.max_m, sampled_m - longest_m / kSamples)
          << "seed " << seed << " triangle " << i;
      ASSERT_TRUE(told(found, kOptions));
      below_cap += sampled_m > 0 && sampled_m < kOptions.cap_m;
    }
  }
  EXPECT_GT(below_cap, 40);
}

// --- against sampling

TEST(Proximity, AgreesWithAFineGrid) {
  const auto silhouettes = hand();
  const Queries q(silhouettes);
  constexpr double kStep_m = 0.0025;
  std::vector<Vector3d> in;
  for (double x = -0.13; x < 0.12; x += kStep_m)
    for (double y = -0.07; y < 0.07; y += kStep_m)
      for (double z = -0.07; z < 0.07; z += kStep_m)
        if (hull::in_hull(silhouettes, {x, y, z})) in.push_back({x, y, z});
  ASSERT_GT(in.size(), 10'000u);
  Random random(1);
  constexpr collision::ProximityOptions kOptions{0.05, 0.0005};
  const auto points = random_points(random, 300, 0.15);
  const auto found = of_points(q.query, kOptions, points);
  double excess_m = 0;
  int compared = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    double grid_m = kInfinity;
    for (const Vector3d& h : in) grid_m = std::min(grid_m, (h - points[i]).norm());
    ASSERT_LE(found[i].min_m, grid_m);
    if (!(found[i].min_m < kOptions.cap_m)) continue;
    ASSERT_LE(found[i].max_m, grid_m + kOptions.tolerance_m);
    excess_m += grid_m - found[i].max_m;
    ++compared;
  }
  // The grid's nearest point is farther than the hull's: nowhere thin here, by half a cube's
  // diagonal or less in the mean.
  EXPECT_GT(compared, 100);
  EXPECT_LT(excess_m / compared, 0.5 * std::sqrt(3.0) * kStep_m);
}

// One to five cameras with small maps, of an object or of noise.
std::vector<hull::Silhouette> random_rig(Random& random, bool noise) {
  const auto object = random_object(random, 1 + int(uniform(random, 0, 3)));
  std::vector<hull::Silhouette> silhouettes;
  for (int i = int(uniform(random, 0, 5)); i >= 0; --i) {
    const int width = 1 + int(uniform(random, 0, 40)), height = 1 + int(uniform(random, 0, 30));
    geometry::Camera camera =
        random_camera(random, width, height, std::pow(10.0, uniform(random, -0.7, 1)));
    camera.pinhole.fy_px *= uniform(random, 0.7, 1.4);
    camera.pinhole.cx_px += uniform(random, -5, 5);
    silhouettes.push_back(
        {camera, noise ? random_pixels(random, width, height, uniform(random, 0, 1))
                       : hull::true_object_pixels(object, camera, hull::PixelRule::touched)});
  }
  return silhouettes;
}

TEST(ProximityCubes, FreeCubesContainNoHullPoint) {
  int free = 0, near = 0;
  for (int seed = 1; seed <= 400; ++seed) {
    Random random(seed);
    const auto silhouettes = random_rig(random, seed % 5 == 0);
    const hull::HullRule rule = kRules[seed % 4];
    const Queries q(silhouettes, rule);
    if (q.hull.empty()) continue;
    const collision::CubeQuery cubes(q.query);
    for (int i = 0; i < 40; ++i) {
      const Vector3d center = random_in_ball(random, i % 2 ? 0.2 : 1.0);
      // As large as is just free, to a hundredth: where the promise is nearest to being broken.
      double half_edge_m = 1;
      while (half_edge_m > 1e-4 && !cubes.test(center, half_edge_m).free) half_edge_m *= 0.99;
      ASSERT_EQ(
          cubes.test(center, half_edge_m).center_in_hull && cubes.test(center, half_edge_m).free,
          false);
      if (!cubes.test(center, half_edge_m).free) continue;
      ++free;
      near += half_edge_m < 0.2;
      for (int k = 0; k < 120; ++k) {
        Vector3d p(uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1));
        if (k % 3) p /= p.cwiseAbs().maxCoeff();  // on a face
        ASSERT_FALSE(hull::in_hull(silhouettes, center + half_edge_m * p, rule))
            << "seed " << seed << ", " << half_edge_m << " m around " << center.transpose();
      }
    }
  }
  EXPECT_GT(free, 5000);
  EXPECT_GT(near, 2000);
}

TEST(Proximity, BoundsHoldOnEveryRig) {
  int near = 0, wide = 0;
  for (int seed = 1; seed <= 150; ++seed) {
    Random random(seed);
    const auto silhouettes = random_rig(random, seed % 4 == 0);
    const hull::HullRule rule = kRules[seed / 4 % 4];
    const Queries q(silhouettes, rule);
    const collision::ProximityOptions options{0.2, 0.004};
    const auto points = random_points(random, 12, 0.6);
    const auto found = of_points(q.query, options, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto& [least_m, most_m] = found[i];
      ASSERT_LE(least_m, most_m);
      ASSERT_EQ(most_m == 0, hull::in_hull(silhouettes, points[i], rule)) << "seed " << seed;
      expect_ball_kept(silhouettes, rule, points[i], least_m, false, random, 60);
      // A hull point on any ray is no nearer than least_m.
      const geometry::Ray ray{points[i], random_direction(random)};
      const auto entries = hull::reference_intervals(silhouettes, ray, 0, 0.3, rule);
      ASSERT_LE(least_m, entries.empty() ? kInfinity : entries.front().enter + kRounding_m)
          << "seed " << seed;
      near += most_m > 0 && least_m < options.cap_m;
      wide += !told(found[i], options);
    }
    // Asked to a finer tolerance, the bounds still meet.
    const auto finer = of_points(q.query, {0.2, 0.0005}, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      ASSERT_LE(finer[i].min_m, found[i].max_m + kRounding_m) << "seed " << seed;
      ASSERT_LE(found[i].min_m, finer[i].max_m + kRounding_m) << "seed " << seed;
    }
  }
  EXPECT_GT(near, 200);
  EXPECT_LE(wide, near / 50);  // hulls that come to a needle's point
}

// --- what follows from being a distance

TEST(Proximity, IsOneLipschitz) {
  const Queries q(hand());
  Random random(2);
  const auto points = random_points(random, 400, 0.15);
  const auto found = of_points(q.query, {0.05, 0.001}, points);
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t k = 0; k < points.size(); ++k)
      ASSERT_LE(found[i].min_m, found[k].max_m + (points[i] - points[k]).norm() + kRounding_m);
}

TEST(Proximity, IsMonotoneInTheNumberOfCameras) {
  Random random(3);
  const auto points = random_points(random, 400, 0.15);
  const auto three = of_points(Queries(hand(3)).query, {0.05, 0.001}, points),
             four = of_points(Queries(hand(4)).query, {0.05, 0.001}, points);
  int farther = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_LE(three[i].min_m, four[i].max_m);
    farther += four[i].min_m > three[i].max_m;
  }
  EXPECT_GT(farther, 20);
}

TEST(Proximity, ScalesWithTheUnitOfLength) {
  auto silhouettes = hand();
  Random random(4);
  auto points = random_points(random, 300, 0.15);
  const auto found = of_points(Queries(silhouettes).query, {0.05, 0.001}, points);
  constexpr double kScale = 1024;  // a power of two: to the bit
  for (hull::Silhouette& s : silhouettes) s.camera.camera_from_world.translation() *= kScale;
  for (Vector3d& p : points) p *= kScale;
  const auto scaled =
      of_points(Queries(silhouettes).query, {kScale * 0.05, kScale * 0.001}, points);
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_EQ(scaled[i], (collision::Proximity{kScale * found[i].min_m, kScale * found[i].max_m}));
}

TEST(Proximity, IsInvariantUnderTranslation) {
  auto silhouettes = hand();
  Random random(5);
  auto points = random_points(random, 300, 0.15);
  const auto found = of_points(Queries(silhouettes).query, {0.05, 0.001}, points);
  Eigen::Isometry3d moved_from_world = Eigen::Isometry3d::Identity();
  moved_from_world.translate(Vector3d(900, -300, 50))
      .rotate(Eigen::AngleAxisd(1, Vector3d(1, 2, 3).normalized()));
  for (hull::Silhouette& s : silhouettes)
    s.camera.camera_from_world = s.camera.camera_from_world * moved_from_world.inverse();
  for (Vector3d& p : points) p = moved_from_world * p;
  const auto moved = of_points(Queries(silhouettes).query, {0.05, 0.001}, points);
  for (std::size_t i = 0; i < points.size();
       ++i) {  // the lattice lies elsewhere: the bounds differ, and meet
    EXPECT_LE(moved[i].min_m, found[i].max_m + kRounding_m);
    EXPECT_LE(found[i].min_m, moved[i].max_m + kRounding_m);
    EXPECT_TRUE(told(moved[i], {0.05, 0.001}));
  }
}

TEST(Proximity, DistanceIsClampedToTheCap) {
  const Queries q(hand());
  Random random(6);
  const auto points = random_points(random, 300, 0.3);
  const auto far = of_points(q.query, {0.25, 0.001}, points),
             close = of_points(q.query, {0.03, 0.001}, points);
  int beyond = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_LE(close[i].min_m, 0.03);
    if (far[i].min_m > 0.031) {
      EXPECT_EQ(close[i], (collision::Proximity{0.03, kInfinity}));
      ++beyond;
    }
    EXPECT_TRUE(told(close[i], {0.03, 0.001}));
  }
  EXPECT_GT(beyond, 100);
}

// --- degenerate cases

TEST(Proximity, OnTheBorderAndInTheHull) {
  const Queries q(hand());
  Random random(7);
  std::vector<Vector3d> on, in;
  for (int i = 0; i < 200; ++i) {
    const geometry::Ray ray{0.3 * random_direction(random), random_in_ball(random, 0.02)};
    const auto entry =
        q.query.first_entry({ray.origin_world_m, ray.direction_world - ray.origin_world_m}, 0, 2);
    if (entry)
      on.push_back(ray.origin_world_m + *entry * (ray.direction_world - ray.origin_world_m));
    const Vector3d p = random_in_ball(random, 0.08);
    if (q.query.contains(p)) in.push_back(p);
  }
  ASSERT_GT(on.size(), 100u);
  ASSERT_GT(in.size(), 30u);
  for (const collision::Proximity& p : of_points(q.query, {0.05, 0.001}, on)) {
    EXPECT_LE(p.min_m, 1e-12);
    EXPECT_LE(p.max_m, 0.001);
  }
  for (const collision::Proximity& p : of_points(q.query, {0.05, 0.001}, in))
    EXPECT_EQ(p, (collision::Proximity{0, 0}));
}

TEST(Proximity, ReportsUnknownDistances) {
  const collision::ProximityOptions options{0.05, 0.001};
  const std::vector<Vector3d> points = {{0, 0, 0.3}, {kNaN, 0, 0}, {0, kInfinity, 0}};
  const std::vector<collision::Triangle> triangles = {{points[0], points[0], points[0]},
                                                      {points[0], points[1], points[0]}};
  const collision::Proximity unknown{0, kInfinity}, none{kInfinity, kInfinity},
      beyond{0.05, kInfinity};
  const auto silhouettes = hand();
  EXPECT_EQ(of_points(Queries(silhouettes).query, options, points),
            (std::vector{beyond, unknown, unknown}));
  EXPECT_EQ(of_triangles(Queries(silhouettes).query, options, triangles),
            (std::vector{beyond, unknown}));
  auto emptied = silhouettes;
  emptied[1].pixels = hull::ObjectPixels(240, 180);
  EXPECT_EQ(of_points(Queries(emptied).query, options, points),
            (std::vector{none, unknown, unknown}));
  EXPECT_EQ(of_triangles(Queries(emptied).query, options, triangles), (std::vector{none, unknown}));
  EXPECT_EQ(of_points(Queries({}).query, options, points), (std::vector{none, unknown, unknown}));
  auto broken = silhouettes;
  broken[1].camera.pinhole.fx_px = kNaN;
  EXPECT_EQ(of_points(Queries(broken).query, options, points),
            (std::vector{unknown, unknown, unknown}));
}

TEST(Proximity, FarPointsAndCameraCenters) {
  const auto silhouettes = hand();
  const Queries q(silhouettes);
  std::vector<Vector3d> points = {
      {1e3, 0, 0}, {1e9, 1e9, 0}, {1e100, 0, 0}, {-1e300, 1e300, 1e300}};
  for (const hull::Silhouette& s : silhouettes) {
    points.push_back(geometry::camera_center_world_m(s.camera));
    points.push_back(point_in_world(s.camera, {0, 0, 1e-9}));
    points.push_back(point_in_world(s.camera, {0, 0, -1e-9}));
    points.push_back(point_in_world(s.camera, {0, 0, -0.5}));
  }
  for (const double cap_m : {1e-3, 0.05, 10.0}) {
    const auto found = of_points(q.query, {cap_m, cap_m / 100}, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_GE(found[i].min_m, 0);
      EXPECT_LE(found[i].min_m, std::min(cap_m, found[i].max_m));
      if (points[i].norm() > 1e99) continue;             // nothing need be known there
      const double to_hand_m = points[i].norm() - 0.13;  // which lies around the origin
      EXPECT_TRUE(told(found[i], {cap_m, cap_m / 100}))
          << found[i].min_m << " to " << found[i].max_m << " at " << points[i].transpose();
      if (to_hand_m > 1.02 * cap_m) {
        EXPECT_EQ(found[i], (collision::Proximity{cap_m, kInfinity})) << points[i].transpose();
      }
    }
  }
}

TEST(Proximity, TerminatesBelowRoundingTolerance) {
  const Queries q(hand());
  Random random(12);
  for (const double tolerance_m : {1e-9, 1e-15, 1e-300})
    for (const collision::Proximity& p :
         of_points(q.query, {0.05, tolerance_m}, random_points(random, 20, 0.12)))
      EXPECT_LE(p.min_m, p.max_m);
}

TEST(Proximity, RejectsInvalidOptions) {
  const Queries q(hand());
  for (const collision::ProximityOptions& options : {collision::ProximityOptions{0, 0.001},
                                                     {-1, 0.001},
                                                     {kNaN, 0.001},
                                                     {kInfinity, 0.001},
                                                     {0.05, 0},
                                                     {0.05, -1},
                                                     {0.05, kNaN}})
    EXPECT_THROW(collision::HullProximity(q.query, options), std::invalid_argument);
}

// --- same question, same answer

TEST(Proximity, IsIndependentOfThreadsOrderAndEarlierQueries) {
  const auto silhouettes = hand();
  Random random(8);
  const auto points = random_points(random, 2000, 0.15);
  std::vector<collision::Triangle> triangles;
  for (int i = 0; i < 200; ++i) triangles.push_back(random_triangle(random, 0.15, 0.05));
  const collision::ProximityOptions options{0.05, 0.001};
  std::vector<collision::Proximity> expected(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    expected[i] =
        of_points(Queries(silhouettes).query, options, std::span(points).subspan(i, 1))[0];
  const auto expected_triangles = of_triangles(Queries(silhouettes).query, options, triangles);
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), 0);
  for (const int threads : {1, 2, 5}) {
    base::WorkerPool pool(threads);
    hull::CpuHull hull(pool, silhouettes);
    const hull::HullQuery query(hull);
    collision::HullProximity proximity(query, options);
    std::shuffle(order.begin(), order.end(), random);
    std::vector<Vector3d> shuffled;
    for (const std::size_t i : order) shuffled.push_back(points[i]);
    std::vector<collision::Proximity> found(points.size()), found_triangles(triangles.size());
    for (int again = 0; again < 2; ++again) {
      proximity.of_points(shuffled, found);
      proximity.of_triangles(triangles, found_triangles);
      for (std::size_t i = 0; i < order.size(); ++i) ASSERT_EQ(found[i], expected[order[i]]);
      ASSERT_EQ(found_triangles, expected_triangles);
    }
  }
}

// --- triangles and meshes

TEST(ProximityOfTriangles, EqualsTheDistanceOfTheNearestPoint) {
  const Queries q(hand());
  Random random(9);
  const collision::ProximityOptions options{0.05, 0.001};
  int near = 0, crossing = 0;
  for (int i = 0; i < 150; ++i) {
    const collision::Triangle t =
        random_triangle(random, 0.15, std::pow(10.0, uniform(random, -3, -0.7)));
    const collision::Proximity found = of_triangles(q.query, options, std::vector{t})[0];
    constexpr int kSamples = 16;
    std::vector<Vector3d> samples;
    for (int a = 0; a <= kSamples; ++a)
      for (int b = 0; a + b <= kSamples; ++b)
        samples.push_back(t[0] + double(a) / kSamples * (t[1] - t[0]) +
                          double(b) / kSamples * (t[2] - t[0]));
    double least_m = kInfinity, most_m = kInfinity;
    for (const collision::Proximity& p : of_points(q.query, options, samples))
      least_m = std::min(least_m, p.min_m), most_m = std::min(most_m, p.max_m);
    const double longest_m =
        std::max({(t[0] - t[1]).norm(), (t[1] - t[2]).norm(), (t[2] - t[0]).norm()});
    ASSERT_LE(found.min_m, most_m + kRounding_m);
    ASSERT_GE(found.max_m, least_m - longest_m / kSamples - kRounding_m);
    ASSERT_TRUE(told(found, options));
    near += found.min_m > 0 && found.min_m < options.cap_m;
    crossing += found == collision::Proximity{0, 0};
    collision::Triangle permuted = t;
    std::sort(permuted.begin(), permuted.end(),
              [](const Vector3d& a, const Vector3d& b) { return a.x() < b.x(); });
    for (int k = 0; k < 3; ++k) {
      ASSERT_EQ(of_triangles(q.query, options, std::vector{permuted})[0], found);
      ASSERT_EQ(
          of_triangles(q.query, options,
                       std::vector{collision::Triangle{permuted[1], permuted[0], permuted[2]}})[0],
          found);
      std::rotate(permuted.begin(), permuted.begin() + 1, permuted.end());
    }
  }
  EXPECT_GT(near, 40);
  EXPECT_GT(crossing, 5);
}

TEST(ProximityOfTriangles, DegenerateTrianglesEqualPointsAndSegments) {
  const Queries q(hand());
  Random random(10);
  const collision::ProximityOptions options{0.05, 0.001};
  for (int i = 0; i < 60; ++i) {
    const Vector3d a = random_in_ball(random, 0.15), b = random_in_ball(random, 0.15);
    const auto point = of_points(q.query, options, std::vector{a})[0],
               dot = of_triangles(q.query, options, std::vector{collision::Triangle{a, a, a}})[0];
    EXPECT_LE(point.min_m, dot.max_m + kRounding_m);
    EXPECT_LE(dot.min_m, point.max_m + kRounding_m);
    EXPECT_TRUE(told(dot, options));
    const Vector3d sliver = a + 0.3 * (b - a) + 1e-9 * random_direction(random);
    const auto line = of_triangles(
        q.query, options,
        std::vector<collision::Triangle>{{a, b, a + 0.3 * (b - a)}, {a, b, b}, {a, b, sliver}});
    for (const collision::Proximity& p : line) {
      for (const collision::Proximity& other : line) EXPECT_LE(p.min_m, other.max_m + 2e-9);
      EXPECT_TRUE(told(p, options));
    }
  }
}

TEST(ProximityOfTriangles, MuchLargerThanTheHull) {
  const Queries q(hand());
  const double top_m = 0.2;
  const collision::Triangle wide = {Vector3d(-10, -10, top_m), {10, -10, top_m}, {0, 10, top_m}},
                            through = {Vector3d(-10, -10, 0.01), {10, -10, 0.01}, {0, 10, 0.01}};
  const auto found = of_triangles(q.query, {0.3, 0.001}, std::vector{wide, through});
  double sampled_m = kInfinity;  // of the plane, from the hull's own points
  Random random(11);
  for (int i = 0; i < 20'000; ++i)
    if (const Vector3d p = random_in_ball(random, 0.13); q.query.contains(p))
      sampled_m = std::min(sampled_m, top_m - p.z());
  EXPECT_LE(found[0].min_m, sampled_m);
  EXPECT_LE(found[0].max_m, sampled_m + 0.001);
  EXPECT_GT(found[0].min_m, sampled_m - 0.01);
  EXPECT_EQ(found[1], (collision::Proximity{0, 0}));
  EXPECT_EQ(of_triangles(q.query, {0.05, 0.001}, std::vector{wide})[0],
            (collision::Proximity{0.05, kInfinity}));
}

TEST(ProximityOfMeshes, EqualsPerVertexAndPerTriangleQueries) {
  const Queries q(hand());
  const collision::ProximityOptions options{0.05, 0.001};
  const geometry::Mesh mesh = geometry::sphere_mesh(0.07, 3);
  Eigen::Isometry3d world_from_object = Eigen::Isometry3d::Identity();
  world_from_object.translate(Vector3d(0.06, 0.02, 0.04))
      .rotate(Eigen::AngleAxisd(0.7, Vector3d(3, 2, 1).normalized()));
  collision::HullProximity proximity(q.query, options);
  const collision::MeshProximity found = proximity.of_mesh(mesh, world_from_object);
  std::vector<Vector3d> vertices;
  for (const Vector3d& v : mesh.vertices_m) vertices.push_back(world_from_object * v);
  EXPECT_EQ(found.vertices, of_points(q.query, options, vertices));
  const auto triangles =
      of_triangles(q.query, options, collision::world_triangles(mesh, world_from_object));
  ASSERT_EQ(found.triangles.size(), triangles.size());
  int near = 0;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    EXPECT_LE(found.triangles[i].min_m, triangles[i].max_m);
    EXPECT_LE(triangles[i].min_m, found.triangles[i].max_m);
    for (const std::uint32_t v : mesh.triangles[i])
      EXPECT_LE(found.triangles[i].min_m, found.vertices[v].max_m);
    EXPECT_TRUE(told(found.triangles[i], options));
    near += found.triangles[i].min_m > 0;
  }
  EXPECT_GT(near, 200);
  const collision::MeshProximity nothing = proximity.of_mesh({}, world_from_object);
  EXPECT_TRUE(nothing.vertices.empty() && nothing.triangles.empty());
}

}  // namespace
}  // namespace fivepipe::test
