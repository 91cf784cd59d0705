// The certified margins of contact_simd.h for one camera, in maps of real sizes, near the camera's
// center and far from the world's origin. The shapes graze borders of its pixels. An exact
// projection is the reference, and in_hull(), which computes in double, may not contradict it.
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <set>
#include <tuple>

#include "common/collision/detection/cpu/contact_simd.h"
#include "tests/support/collision/scene.h"

namespace fivepipe::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
// 64 bits of mantissa: 2^11 times finer than double, which is 2^29 times finer than the float under
// test
using Exact = long double;
using ExactVector = Eigen::Matrix<Exact, 3, 1>;

struct Map {
  hull::Silhouette silhouette;
  base::WorkerPool pool{1};
  hull::CpuHull hull;
  explicit Map(hull::Silhouette s) : silhouette(std::move(s)), hull(pool, {&silhouette, 1}) {
    hull.make_all_quadrants();
  }
  const hull::CpuHull::MapCamera& camera() const { return hull.cameras()[0]; }
  bool object(Exact u, Exact v) const {
    return silhouette.pixels.contains_at(double(u), double(v));
  }
};

// Projects a world point to (U, V, W); the pixel is (U, V) / W.
ExactVector image_of_point(const geometry::Camera& camera, const ExactVector& p_world_m) {
  const ExactVector p = camera.camera_from_world.linear().cast<Exact>() * p_world_m +
                        camera.camera_from_world.translation().cast<Exact>();
  const geometry::Pinhole& k = camera.pinhole;
  return {k.fx_px * p.x() + k.cx_px * p.z(), k.fy_px * p.y() + k.cy_px * p.z(), p.z()};
}

// The truth about a convex shape with these corners. `none` and `all` hold only if it is wholly in
// front of the camera.
struct Truth {
  bool whole_in_front = true, behind = true;
  bool any_corner_in_hull = false, all_corners_in_hull = true;  // by in_hull()
  // Whether none, or all, of the pixels that the corners' bounding rectangle meets are object
  // pixels.
  bool none = true, all = true;
};

Truth truth_of(const Map& map, const std::vector<ExactVector>& corners_world_m) {
  Truth truth;
  Exact low_u = 1e30L, high_u = -1e30L, low_v = 1e30L, high_v = -1e30L;
  for (const ExactVector& corner : corners_world_m) {
    const bool in_hull = hull::in_hull({&map.silhouette, 1}, corner.cast<double>());
    truth.any_corner_in_hull |= in_hull;
    truth.all_corners_in_hull &= in_hull;
    const ExactVector image = image_of_point(map.silhouette.camera, corner);
    truth.behind &= image.z() <= 0;
    truth.whole_in_front &= image.z() > 0;
    if (!(image.z() > 0)) continue;
    const Exact u = image.x() / image.z(), v = image.y() / image.z();
    low_u = std::min(low_u, u), high_u = std::max(high_u, u), low_v = std::min(low_v, v),
    high_v = std::max(high_v, v);
  }
  if (!truth.whole_in_front) return truth;
  const auto pixel = [](Exact x) { return int(std::clamp(std::floor(x + 0.5L), -1e6L, 1e6L)); };
  const hull::ObjectPixels& pixels = map.silhouette.pixels;
  const hull::PixelRect rect{pixel(low_u), pixel(low_v), pixel(high_u) + 1, pixel(high_v) + 1},
      seen = intersection(rect, {0, 0, pixels.width_px(), pixels.height_px()});
  truth.all = rect == seen;
  for (int v = seen.v0_px; v < seen.v1_px && (truth.none || truth.all) && !seen.empty(); ++v) {
    truth.none &= pixels.find(seen.u0_px, seen.u1_px, v, true) == seen.u1_px;
    truth.all &= pixels.find(seen.u0_px, seen.u1_px, v, false) == seen.u1_px;
  }
  return truth;
}

struct Tally {
  int free = 0, solid = 0, mixed = 0, wrong = 0;
  void count(bool is_free, bool is_solid, const Truth& truth) {
    ++(is_free ? free : is_solid ? solid : mixed);
    if (is_free && !truth.behind && truth.whole_in_front) wrong += !truth.none;
    if (is_free) wrong += truth.any_corner_in_hull;
    if (is_solid) wrong += !(truth.whole_in_front && truth.all && truth.all_corners_in_hull);
  }
};

// Three rectangles of object pixels, often far apart.
hull::ObjectPixels rectangles(Random& random, int width_px, int height_px) {
  hull::ObjectPixels pixels(width_px, height_px);
  for (int i = 0; i < 3; ++i) {
    const int u0 = int(uniform(random, 0, width_px - 2)),
              v0 = int(uniform(random, 0, height_px - 2));
    const int u1 = std::min(width_px, u0 + 1 + int(uniform(random, 0, 0.5 * width_px)));
    const int v1 = std::min(height_px, v0 + 1 + int(uniform(random, 0, 0.5 * height_px)));
    for (int v = v0; v < v1; ++v)
      for (int u = u0; u < u1; ++u) pixels.set(u, v);
  }
  return pixels;
}

Isometry3d random_pose(Random& random, double off_m) {
  Isometry3d pose = Isometry3d::Identity();
  pose.linear() = random_rotation(random, -3, 3).toRotationMatrix();
  pose.translation() = off_m * random_direction(random);
  return pose;
}

// A camera, its map, and the pose of an object in front of it.
struct Scene {
  Map map;
  Isometry3d world_from_tree;
  double radius_m;
  Scene(hull::Silhouette s, const Isometry3d& pose, double radius)
      : map(std::move(s)), world_from_tree(pose), radius_m(radius) {}
};

Scene random_scene(Random& random, double far_m, double radius_m, double distance_m) {
  const int size = int(random() % 3),
            width_px = size == 0   ? 1920
                       : size == 1 ? 720
                                   : 97 + int(uniform(random, 0, 600)),
            height_px = size == 0   ? 1080
                        : size == 1 ? 486
                                    : 61 + int(uniform(random, 0, 400));
  // From a long focal length to an angle so wide that images far beside the map are near the
  // camera.
  const double fov_rad = random() % 2   ? uniform(random, 0.3, 1.4)
                         : random() % 2 ? std::pow(10, uniform(random, -2.5, -0.5))
                                        : uniform(random, 1.4, 3.0);
  Isometry3d world_from_tree = random_pose(random, far_m);
  const Vector3d eye = world_from_tree.translation() + distance_m * random_direction(random);
  geometry::Camera camera{
      geometry::pinhole_from_fov(width_px, height_px, fov_rad),
      geometry::look_at(eye, world_from_tree.translation(), random_direction(random))};
  // The axes of the object's frame are often those of the camera.
  if (random() % 3 == 0) world_from_tree.linear() = camera.camera_from_world.linear().transpose();
  return {{camera, rectangles(random, width_px, height_px)}, world_from_tree, radius_m};
}

// A world point within the tree's radius whose image is on a border between pixels, to rounding;
// often on the border of the object pixels' bounds. Its depth may be far below what float can
// represent reliably.
Vector3d grazing_point_world(Random& random, const Scene& scene) {
  const hull::PixelRect& bounds = scene.map.camera().skip_map.bounds();
  const auto on_border = [&](int low, int high) {
    const double any = std::floor(uniform(random, low - 5, high + 5));
    return (uniform(random, 0, 1) < 0.5 ? any : uniform(random, 0, 1) < 0.5 ? low : high) - 0.5;
  };
  // Power of ten of the lowest depth: some points are at the camera's center, to rounding.
  const double lowest = random() % 8 ? -4 : random() % 2 ? -10 : -18;
  for (int tries = 0;; ++tries) {
    Eigen::Vector2d uv_px{uniform(random, bounds.u0_px, bounds.u1_px),
                          uniform(random, bounds.v0_px, bounds.v1_px)};
    const double which = uniform(random, 0, 3);
    if (which < 2) uv_px.x() = on_border(bounds.u0_px, bounds.u1_px);
    if (which > 1) uv_px.y() = on_border(bounds.v0_px, bounds.v1_px);
    const geometry::Ray ray = geometry::ray_through(scene.map.silhouette.camera, uv_px);
    const Vector3d p_world = ray.origin_world_m + scene.radius_m *
                                                      std::pow(10, uniform(random, lowest, 0.5)) *
                                                      ray.direction_world;
    if ((scene.world_from_tree.inverse() * p_world).norm() < scene.radius_m || tries > 1000)
      return p_world;
  }
}

float nudged(Random& random, double x) {
  float f = float(x);
  for (int steps = int(uniform(random, -3.99, 3.99)); steps != 0; steps += steps > 0 ? -1 : 1)
    f = std::nextafter(f, steps > 0 ? 1e30f : -1e30f);
  return f;
}

double random_size(Random& random, double max_size) {
  return max_size * std::pow(10, uniform(random, -5, 0));
}

template <class Check>
void for_each_scene(int scenes, const Check& check) {
  Random random(1);
  for (int i = 0; i < scenes; ++i) {
    // At 1e8 m from the origin the images in double are less precise than those in float.
    const double far_m[] = {0, 1, 1000, 0, 1e8, 0, 1e11}, radius_m[] = {0.2, 1.0, 0.7, 5.0};
    const double radius = radius_m[i % 4];
    // The camera is between well in front of the object and inside it, where W is close to min_w.
    check(random, random_scene(random, far_m[i % 7], radius, radius * uniform(random, 0.1, 2)));
  }
}

TEST(ContactSimd, BoxesGrazingPixelsAreClassifiedConservatively) {
  Tally tally;
  for_each_scene(120, [&](Random& random, const Scene& scene) {
    const auto map =
        collision::object_map(scene.map.camera(), scene.world_from_tree, scene.radius_m);
    if (!map) return;
    for (int batch = 0; batch < 48; ++batch) {
      collision::Bvh::Boxes boxes;
      for (std::size_t i = 0; i < collision::Bvh::kArity; ++i) {
        const Vector3d corner =
            scene.world_from_tree.inverse() * grazing_point_world(random, scene);
        // A box as large as the object may have its center far beside the map.
        const bool large = random() % 4 == 0;
        const double size =
            large ? 0.9 * scene.radius_m : random_size(random, 0.9 * scene.radius_m);
        const Vector3d sight =
            scene.world_from_tree.linear().transpose() *
            scene.map.silhouette.camera.camera_from_world.linear().row(2).transpose();
        const bool away = uniform(random, 0, 1) < 0.7;  // the box extends away from the camera
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const double half = size * std::pow(uniform(random, 0, 1), large ? 1 : 3),
                       x = corner[Eigen::Index(axis)];
          const double sign =
              (away ? sight[Eigen::Index(axis)] > 0 : uniform(random, 0, 1) < 0.5) ? 1 : -1;
          const double center = std::clamp(x + sign * half, -scene.radius_m, scene.radius_m);
          boxes.center_m[axis][i] = nudged(random, center);
          boxes.half_m[axis][i] =
              std::min(nudged(random, std::abs(x - double(boxes.center_m[axis][i]))),
                       float(scene.radius_m - std::abs(center)));
          boxes.half_m[axis][i] = std::max(boxes.half_m[axis][i], 0.0f);
        }
      }
      const collision::ContactBits bits = collision::classify_boxes({&*map, 1}, boxes);
      for (std::size_t i = 0; i < collision::Bvh::kArity; ++i) {
        std::vector<ExactVector> corners;
        for (int corner = 0; corner < 8; ++corner) {
          ExactVector p;
          for (std::size_t axis = 0; axis < 3; ++axis)
            p[Eigen::Index(axis)] = Exact(boxes.center_m[axis][i]) +
                                    (corner >> axis & 1 ? 1 : -1) * Exact(boxes.half_m[axis][i]);
          corners.push_back(scene.world_from_tree.linear().cast<Exact>() * p +
                            scene.world_from_tree.translation().cast<Exact>());
        }
        tally.count(bits.free >> i & 1, bits.solid >> i & 1, truth_of(scene.map, corners));
      }
    }
  });
  EXPECT_EQ(tally.wrong, 0);
  std::printf("boxes: %d free, %d solid, %d mixed\n", tally.free, tally.solid, tally.mixed);
  EXPECT_GT(tally.free, 1000);
  EXPECT_GT(tally.solid, 1000);
  EXPECT_GT(tally.mixed, 1000);
}

TEST(ContactSimd, TrianglesGrazingPixelsAreClassifiedConservatively) {
  Tally tally;
  for_each_scene(120, [&](Random& random, const Scene& scene) {
    const auto map =
        collision::object_map(scene.map.camera(), scene.world_from_tree, scene.radius_m);
    if (!map) return;
    for (int batch = 0; batch < 48; ++batch) {
      collision::Bvh::Leaf leaf;
      std::array<std::array<Vector3d, 3>, collision::Bvh::kArity> vertices_world_m;
      for (std::size_t i = 0; i < collision::Bvh::kArity; ++i) {
        const Vector3d first = scene.world_from_tree.inverse() * grazing_point_world(random, scene);
        const double size = random_size(random, scene.radius_m);
        for (std::size_t k = 0; k < 3; ++k) {
          Vector3d p = k == 0 ? first : Vector3d(first + random_in_ball(random, size));
          if (k > 0 && uniform(random, 0, 1) < 0.3)
            p = scene.world_from_tree.inverse() * grazing_point_world(random, scene);
          const Vector3d within = p.norm() < scene.radius_m ? p : first;
          vertices_world_m[i][k] =
              scene.world_from_tree * within;  // in double, as a detection computes it
          for (std::size_t axis = 0; axis < 3; ++axis)
            leaf.vertices_m[k][axis][i] = float(within[Eigen::Index(axis)]);
        }
      }
      const collision::ContactBits bits =
          collision::classify_leaf({&*map, 1}, leaf, collision::Bvh::kArity);
      for (std::size_t i = 0; i < collision::Bvh::kArity; ++i) {
        std::vector<ExactVector> corners;
        for (const Vector3d& v : vertices_world_m[i]) corners.push_back(v.cast<Exact>());
        tally.count(bits.free >> i & 1, bits.solid >> i & 1, truth_of(scene.map, corners));
      }
    }
  });
  EXPECT_EQ(tally.wrong, 0);
  std::printf("triangles: %d free, %d solid, %d mixed\n", tally.free, tally.solid, tally.mixed);
  EXPECT_GT(tally.free, 1000);
  EXPECT_GT(tally.solid, 1000);
  EXPECT_GT(tally.mixed, 1000);
}

// A triangle divided into parts of size h. A corner of a part, or its center, grazes a pixel
// border: v0 + a / units (v1 - v0) + b / units (v2 - v0) = p, to rounding.
struct Grazing {
  std::array<Vector3d, 3> vertices_world_m;
  double units, h;
};

// A triangle whose second vertex grazes a border and is much nearer to the camera than the others:
// there the rounding of float is largest.
std::array<Vector3d, 3> deep_triangle_world_m(Random& random, const Scene& scene) {
  const geometry::Camera& camera = scene.map.silhouette.camera;
  const Vector3d p_world = grazing_point_world(random, scene);
  const double depth_m = (camera.camera_from_world * p_world).z();
  const auto behind = [&] {
    const geometry::Ray ray =
        geometry::ray_through(camera, {uniform(random, -200, camera.pinhole.width_px + 200.0),
                                       uniform(random, -200, camera.pinhole.height_px + 200.0)});
    return Vector3d(ray.origin_world_m +
                    depth_m * std::pow(10, uniform(random, 0, 3)) * ray.direction_world);
  };
  return {behind(), p_world, behind()};
}

// A triangle behind the camera except for a vertex at the camera's center, to rounding.
std::array<Vector3d, 3> triangle_at_center_world_m(Random& random, const Scene& scene) {
  const geometry::Camera& camera = scene.map.silhouette.camera;
  const Vector3d center = geometry::camera_center_world_m(camera),
                 forward = camera.camera_from_world.linear().row(2).transpose();
  const auto behind = [&] {
    const Vector3d off = random_in_ball(random, scene.radius_m);
    return Vector3d(center + (off.dot(forward) < 0 ? off : Vector3d(-off)));
  };
  return {center + 1e-16 * (1 + center.norm()) * random_direction(random), behind(), behind()};
}

Grazing grazing_triangle(Random& random, const Scene& scene) {
  const double units = std::exp2(int(uniform(random, 0, 8))),
               h = std::min(units, std::max(units / 16, std::exp2(int(uniform(random, 0, 5))))),
               size = random_size(random, scene.radius_m), parts = units / h;
  if (random() % 3 == 0) return {deep_triangle_world_m(random, scene), units, h};
  if (random() % 8 == 0) return {triangle_at_center_world_m(random, scene), units, h};
  const Vector3d p = grazing_point_world(random, scene), u = random_in_ball(random, size),
                 v = random_in_ball(random, size);
  // A center, or a corner. It is often at a vertex other than the first, where float has the
  // largest error.
  const bool center = random() % 2;
  const double last = center ? parts - 1 : parts, any = std::floor(uniform(random, 0, last + 1)),
               i = random() % 2   ? any
                   : random() % 2 ? 0
                                  : last,
               j = random() % 2 ? std::floor(uniform(random, 0, last - i + 1)) : last - i,
               third = center ? h / 3 : 0, a = i * h + third, b = j * h + third;
  const Vector3d first = p - a / units * u - b / units * v;
  return {{first, first + u, first + v}, units, h};
}

ExactVector point_of(const Grazing& t, Exact a, Exact b) {
  const ExactVector v0 = t.vertices_world_m[0].cast<Exact>(),
                    v1 = t.vertices_world_m[1].cast<Exact>(),
                    v2 = t.vertices_world_m[2].cast<Exact>();
  return v0 + a / Exact(t.units) * (v1 - v0) + b / Exact(t.units) * (v2 - v0);
}

collision::Cells cells_of(const Grazing& t, double h) {
  collision::Cells cells;
  for (double b = 0; b < t.units; b += h)
    for (double a = 0; a + b < t.units; a += h) {
      cells.add(float(a), float(b), 1);
      if (a + b + h < t.units) cells.add(float(a + h), float(b + h), -1);
    }
  return cells;
}

using Cell = std::tuple<float, float, float>;
std::set<Cell> as_set(const collision::Cells& cells) {
  std::set<Cell> set;
  for (std::size_t i = 0; i < cells.count; ++i) set.emplace(cells.a[i], cells.b[i], cells.sigma[i]);
  return set;
}

// The tallies of the parts of triangles, and of their centers.
struct CellTallies {
  Tally parts, centers;
  int culled = 0;

  void add(Random& random, const Scene& scene) {
    const Grazing t = grazing_triangle(random, scene);
    collision::TriangleMap map;
    const collision::ProjectionStatus status =
        collision::triangle_map(collision::pixel_from_world(scene.map.silhouette.camera),
                                scene.map.camera().skip_map, t.vertices_world_m, t.units, map);
    if (status == collision::ProjectionStatus::culled) {
      ++culled;
      const Truth truth = truth_of(
          scene.map, {point_of(t, 0, 0), point_of(t, t.units, 0), point_of(t, 0, t.units)});
      EXPECT_TRUE(truth.behind || (truth.whole_in_front && truth.none));
      EXPECT_FALSE(truth.any_corner_in_hull);
    }
    if (status != collision::ProjectionStatus::in_front) return;
    const collision::Cells cells = cells_of(t, t.h);
    collision::Cells mixed, solid, inside, uncertain;
    collision::classify_cells({&map, 1}, cells, float(t.h), mixed, solid);
    collision::classify_centers({&map, 1}, cells, float(t.h), inside, uncertain);
    const auto are_mixed = as_set(mixed), are_solid = as_set(solid), are_inside = as_set(inside),
               are_uncertain = as_set(uncertain);
    for (std::size_t i = 0; i < cells.count; ++i) {
      const Cell cell(cells.a[i], cells.b[i], cells.sigma[i]);
      const Exact a = cells.a[i], b = cells.b[i], step = cells.sigma[i] * Exact(t.h);
      const bool is_solid = are_solid.contains(cell),
                 is_free = !is_solid && !are_mixed.contains(cell);
      parts.count(is_free, is_solid,
                  truth_of(scene.map, {point_of(t, a, b), point_of(t, a + step, b),
                                       point_of(t, a, b + step)}));
      const bool is_inside = are_inside.contains(cell),
                 is_outside = !is_inside && !are_uncertain.contains(cell);
      centers.count(is_outside, is_inside,
                    truth_of(scene.map, {point_of(t, a + step / 3, b + step / 3)}));
    }
  }
};

TEST(ContactSimd, CellsGrazingPixelsAreClassifiedConservatively) {
  CellTallies tallies;
  for_each_scene(120, [&](Random& random, const Scene& scene) {
    for (int i = 0; i < 60; ++i) tallies.add(random, scene);
  });
  const auto& [tally, centers, culled] = tallies;
  EXPECT_EQ(tally.wrong, 0);
  EXPECT_EQ(centers.wrong, 0);
  std::printf(
      "parts: %d free, %d solid, %d mixed; centers: %d outside, %d inside, %d uncertain; triangles "
      "culled: %d\n",
      tally.free, tally.solid, tally.mixed, centers.free, centers.solid, centers.mixed, culled);
  for (const int count : {tally.free, tally.solid, tally.mixed, centers.free, centers.solid})
    EXPECT_GT(count, 1000);
  EXPECT_GT(centers.mixed, 30);
  EXPECT_GT(culled, 10);
}

}  // namespace
}  // namespace fivepipe::test
