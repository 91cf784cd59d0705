// Projections in float and their margins: random points stay within the margins, and the margins
// are the errors that the table of contact_maps.cpp derives.
#include <algorithm>
#include <cmath>
#include <optional>

#include "common/collision/detection/cpu/contact_maps.h"
#include "tests/support/collision/scene.h"
#include "tests/support/not_finite.h"

namespace fivepipe::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Long = long double;
using Vector3l = Eigen::Matrix<Long, 3, 1>;

constexpr double kHalfUlp = 0x1p-24;  // half a unit in the last place of float
// Relative: the margins are at least the derived errors, up to rounding, and at most 5 % more.
constexpr double kDerivedLess = 1e-6, kDerivedMore = 0.05;

// A camera with three object pixels, 1 m or 1,000 km from the world's origin.
struct MapScene {
  double far_m;
  Vector3d shift_m;
  hull::CpuHull::MapCamera camera;
  hull::PixelRect bounds;
  Matrix3d of_world;  // to (U, V, W), of pixels that begin at whole numbers
  Vector3d at_world;

  MapScene(Random& random, int number)
      : far_m(number % 3 == 2 ? 1e6 : 1), shift_m(far_m * random_direction(random)) {
    const int width = 100 + int(uniform(random, 0, 400)), height = 90;
    camera.camera = random_camera(random, width, height);
    camera.camera.camera_from_world = camera.camera.camera_from_world * at(-shift_m);
    hull::ObjectPixels pixels(width, height);
    for (int i = 0; i < 3; ++i) {
      const int u = int(uniform(random, 0, width)), v = int(uniform(random, 0, height));
      pixels.set(u, v);
    }
    camera.skip_map.assign(pixels);
    camera.skip_map.make(hull::Quadrant::right_down);
    bounds = pixels.bounds();
    const geometry::Pinhole& k = camera.camera.pinhole;
    Matrix3d image;
    image << k.fx_px, 0, k.cx_px + 0.5, 0, k.fy_px, k.cy_px + 0.5, 0, 0, 1;
    of_world = image * camera.camera.camera_from_world.linear();
    at_world = image * camera.camera.camera_from_world.translation();
  }

  // Sizes of the terms of U, V and W in the world.
  Vector3d world_terms(const Vector3d& p, double radius_m) const {
    return of_world.cwiseAbs() * (p.cwiseAbs() + Vector3d::Constant(radius_m)) +
           at_world.cwiseAbs();
  }
  // The error of a projection in double, times W [px m].
  static double of_projection(const Vector3d& terms, double image_px) {
    return 32 * 0x1p-52 * (std::max(terms.x(), terms.y()) + image_px * terms.z());
  }
  // Moves the origin of the images to the base pixel of a map.
  Matrix3d to_base(const collision::ContactMap& map) const {
    Matrix3d base = Matrix3d::Identity();
    base(0, 2) = -(bounds.u0_px - double(map.begin_u));
    base(1, 2) = -(bounds.v0_px - double(map.begin_v));
    return base;
  }
  double farthest_px() const { return 0.5 * std::max(bounds.width_px(), bounds.height_px()) + 1; }
  // (U, V, W) of a point in the world.
  Vector3l project(const collision::ContactMap& map, const Vector3l& p_world_m) const {
    return to_base(map).cast<Long>() * (of_world.cast<Long>() * p_world_m + at_world.cast<Long>());
  }

  Isometry3d random_tree(Random& random, const Vector3d& origin_m) const {
    Isometry3d world_from_tree = at(origin_m);
    world_from_tree.linear() = random_rotation(random, 0, 3).toRotationMatrix();
    return world_from_tree;
  }
  // Vertices in front of the camera.
  std::array<Vector3d, 3> random_vertices(Random& random, double side_m, double min_w_m) const {
    std::array<Vector3d, 3> vertices_world_m;
    for (Vector3d& v : vertices_world_m)
      v = camera.camera.camera_from_world.inverse() * Vector3d{uniform(random, -side_m, side_m),
                                                               uniform(random, -side_m, side_m),
                                                               uniform(random, min_w_m, 2)};
    return vertices_world_m;
  }
};

// The largest error of an image and of W, relative to their margins. The margins add up the largest
// roundings of some ten operations in the worst case; random ones reach 4 to 8 % of them. Margins
// of twice the size would halve that, below the tests' kMinRatio.
struct Ratios {
  double image = 0, w = 0;
  void add(const collision::ContactMap& map, const Eigen::Vector3f& found, const Vector3l& truth) {
    const float per_w = 1 / found.z();
    for (int axis = 0; axis < 2; ++axis)
      add(image, std::abs(Long(found[axis] * per_w) - truth[axis] / truth.z()) / Long(map.eps_px));
  }
  static void add(double& largest, Long ratio) {
    EXPECT_LE(ratio, 1);
    largest = std::max(largest, double(ratio));
  }
};

// Points that the camera sees on its map, as near as the map allows.
TEST(ContactMaps, PointsOfAnObjectAreWithinTheMargins) {
  Random random(23);
  Ratios largest;
  for (int number = 0; number < 60; ++number) {
    const MapScene scene(random, number);
    const double radius_m = uniform(random, 0.05, 0.5);
    const Vector3d eye_m = geometry::camera_center_world_m(scene.camera.camera);
    const Isometry3d world_from_tree =
        scene.random_tree(random, eye_m + random_in_ball(random, 0.5 * radius_m));
    const auto map = collision::object_map(scene.camera, world_from_tree, radius_m);
    ASSERT_TRUE(map);
    const Matrix3d of = scene.to_base(*map) * scene.of_world * world_from_tree.linear();
    const Vector3d at_tree =
        scene.to_base(*map) * (scene.of_world * world_from_tree.translation() + scene.at_world);
    for (int i = 0; i < 2000; ++i) {
      const double w = map->min_w * uniform(random, 1, 1.1), u = scene.farthest_px();
      const Vector3d image{uniform(random, -u, u), uniform(random, -u, u), 1};
      const Eigen::Vector3f p = (of.inverse() * (w * image - at_tree)).cast<float>();
      if (p.norm() > float(radius_m)) continue;
      Eigen::Vector3f found;
      for (int row = 0; row < 3; ++row)
        found[row] = map->at[row] + p.x() * map->of[row][0] + p.y() * map->of[row][1] +
                     p.z() * map->of[row][2];
      const Vector3l truth =
          scene.project(*map, world_from_tree.linear().cast<Long>() * p.cast<Long>() +
                                  world_from_tree.translation().cast<Long>());
      Ratios::add(largest.w, std::abs(found.z() - truth.z()) / Long(map->slack_w));
      if (found.z() >= map->min_w) largest.add(*map, found, truth);
    }
  }
  constexpr double kMinRatio = 0.03;
  EXPECT_GT(largest.w, kMinRatio);
  EXPECT_GT(largest.image, kMinRatio);
}

TEST(ContactMaps, PointsOfATriangleAreWithinTheMargins) {
  constexpr int kUnits = 8;
  Random random(24);
  Ratios largest;
  int in_front = 0;
  for (int number = 0; number < 3000; ++number) {
    const MapScene scene(random, number);
    const auto vertices_world_m = scene.random_vertices(random, 0.2, 0.05);
    collision::TriangleMap map;
    if (collision::triangle_map(collision::pixel_from_world(scene.camera.camera),
                                scene.camera.skip_map, vertices_world_m, kUnits,
                                map) != collision::ProjectionStatus::in_front)
      continue;
    ++in_front;
    const auto vertex = [&](std::size_t i) { return vertices_world_m[i].cast<Long>(); };
    for (int a = 0; a <= kUnits; ++a)
      for (int b = 0; a + b <= kUnits; ++b) {
        Eigen::Vector3f found;
        for (int row = 0; row < 3; ++row)
          found[row] = map.at[row] + float(a) * map.by_a[row] + float(b) * map.by_b[row];
        const Vector3l p = vertex(0) + Long(a) / kUnits * (vertex(1) - vertex(0)) +
                           Long(b) / kUnits * (vertex(2) - vertex(0));
        largest.add(map, found, scene.project(map, p));
      }
  }
  EXPECT_GT(in_front, 1000);
  constexpr double kMinRatio = 0.05;
  EXPECT_GT(largest.image, kMinRatio);
}

// Random points reach a small part of the margins, so margins that are too small by half are
// noticed only by comparison with their derivation.
TEST(ContactMaps, MarginsOfAnObjectAreTheDerivedErrors) {
  Random random(22);
  for (int number = 0; number < 60; ++number) {
    const MapScene scene(random, number);
    const hull::PixelRect& bounds = scene.bounds;
    const Isometry3d world_from_tree =
        scene.random_tree(random, scene.shift_m + random_in_ball(random, 0.2));
    const double radius_m = uniform(random, 0.05, 0.5);
    const auto map = collision::object_map(scene.camera, world_from_tree, radius_m);
    ASSERT_TRUE(map);
    const double base_u = bounds.u0_px - double(map->begin_u),
                 base_v = bounds.v0_px - double(map->begin_v);
    EXPECT_EQ(map->end_u, float(bounds.u1_px - base_u));
    EXPECT_EQ(map->end_v, float(bounds.v1_px - base_v));
    const Matrix3d of = scene.to_base(*map) * scene.of_world * world_from_tree.linear();
    const Vector3d at_tree = scene.to_base(*map) *
                             (scene.of_world * world_from_tree.translation() + scene.at_world),
                   terms = at_tree.cwiseAbs() + radius_m * of.cwiseAbs().rowwise().sum();
    for (int row = 0; row < 3; ++row) {
      EXPECT_NEAR(map->at[row], at_tree[row], kDerivedLess * terms[row] + 1e-9 * scene.far_m);
      for (int axis = 0; axis < 3; ++axis)
        EXPECT_NEAR(map->of[row][axis], of(row, axis), kDerivedLess * terms[row] / radius_m);
    }
    const double farthest_px = scene.farthest_px(),
                 image_px = std::max(std::abs(base_u), std::abs(base_v)) + farthest_px,
                 projection = MapScene::of_projection(
                     scene.world_terms(world_from_tree.translation(), radius_m), image_px),
                 w_error_m = 12 * kHalfUlp * terms.z() + projection,
                 error_px_m =
                     12 * kHalfUlp * (std::max(terms.x(), terms.y()) + farthest_px * terms.z()) +
                     projection;
    EXPECT_EQ(map->eps_px, 1.0f / 64);
    EXPECT_GE(map->slack_w, w_error_m * (1 - kDerivedLess));
    EXPECT_LE(map->slack_w, w_error_m * (1 + kDerivedMore));
    EXPECT_FLOAT_EQ(map->max_behind_w, -2 * map->slack_w);
    const double per_w_px = 1.0 / 64 - 8 * kHalfUlp * farthest_px;
    EXPECT_GE(map->min_w * per_w_px, error_px_m * (1 - kDerivedLess));
    EXPECT_LE(map->min_w * per_w_px, error_px_m * (1 + kDerivedMore));
  }
}

TEST(ContactMaps, TheMarginOfATriangleIsTheDerivedError) {
  constexpr int kUnits = 8;
  Random random(22);
  int in_front = 0;
  for (int number = 0; number < 60; ++number) {
    const MapScene scene(random, number);
    const auto vertices_world_m = scene.random_vertices(random, 0.2, 0.8);
    collision::TriangleMap map;
    if (collision::triangle_map(collision::pixel_from_world(scene.camera.camera),
                                scene.camera.skip_map, vertices_world_m, kUnits,
                                map) != collision::ProjectionStatus::in_front)
      continue;
    ++in_front;
    std::array<Vector3d, 3> uvw;
    double nearest_m = kInfinity, off_px = 1, on_image_px = 0;
    Vector3d largest = Vector3d::Zero();
    for (std::size_t i = 0; i < 3; ++i) {
      const Vector3d p = scene.of_world * vertices_world_m[i] + scene.at_world;
      on_image_px = std::max(on_image_px, p.head<2>().cwiseAbs().maxCoeff() / p.z());
      uvw[i] = scene.to_base(map) * p;
      off_px = std::max(off_px, uvw[i].head<2>().cwiseAbs().maxCoeff() / uvw[i].z());
      nearest_m = std::min(nearest_m, p.z());
      largest = largest.cwiseMax(scene.world_terms(vertices_world_m[i], 0));
    }
    const Vector3d sizes =
        uvw[0].cwiseAbs() + (uvw[1] - uvw[0]).cwiseAbs() + (uvw[2] - uvw[0]).cwiseAbs();
    const double eps_px = (10 * kHalfUlp * (std::max(sizes.x(), sizes.y()) + off_px * sizes.z()) +
                           MapScene::of_projection(largest, on_image_px)) /
                              nearest_m +
                          8 * kHalfUlp * off_px;
    EXPECT_GE(map.eps_px, eps_px * (1 - kDerivedLess)) << number;
    EXPECT_LE(map.eps_px, eps_px * (1 + kDerivedMore)) << number;
    for (int row = 0; row < 3; ++row) {
      const double rounding = kDerivedLess * sizes[row] + 1e-9 * scene.far_m;
      EXPECT_NEAR(map.at[row], uvw[0][row], rounding);
      EXPECT_NEAR(kUnits * map.by_a[row], uvw[1][row] - uvw[0][row], rounding);
      EXPECT_NEAR(kUnits * map.by_b[row], uvw[2][row] - uvw[0][row], rounding);
    }
  }
  EXPECT_GT(in_front, 20);
}

}  // namespace
}  // namespace fivepipe::test
