// Limits of collision detection that random scenes do not reach: boxes and triangles exactly at a
// border, the budgets of a triangle's tests, the margins of float, and the default options.
#include <algorithm>
#include <cmath>

#include "common/collision/detection/box_query.h"
#include "common/collision/detection/cpu/detection_common.h"
#include "tests/support/collision/triangles.h"

namespace fivepipe::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

// Looks along z from the origin. Pixel 32 begins at x = 0 and y = 0.
hull::Silhouette columns(int begin, int end) {
  hull::Silhouette s{{{64, 64, 64, 64, 31.5, 31.5}, Isometry3d::Identity()},
                     hull::ObjectPixels(64, 64)};
  for (int v = 0; v < 64; ++v) s.pixels.set_run(begin, end, v);
  return s;
}

// The border of the image is at x, y = -0.5 + pixel / 64 at a depth of 1 m. A box within 1e-7 px of
// an object pixel may contain a hull point, because the projection rounds.
TEST(BoxQuery, CertifiesNoBoxWithinRoundingOfAnObjectPixel) {
  hull::Silhouette s{{{64, 64, 64, 64, 31.5, 31.5}, Isometry3d::Identity()},
                     hull::ObjectPixels(64, 64)};
  for (int v = 16; v < 48; ++v) s.pixels.set_run(16, 48, v);  // x, y = -0.25 to 0.25
  for (const auto& [gap_px, is_free] : {std::pair{1e-7, false}, {1e-3, true}})
    for (const int axis : {0, 1})
      for (const double side : {-1.0, 1.0}) {
        const double near_m = 0.25 + gap_px / 64;
        Vector3d near(0, 0, 1), far(0.01, 0.01, 1);
        near[axis] = side * near_m, far[axis] = side * (near_m + 0.01);
        Eigen::AlignedBox3d box(near);
        box.extend(far);
        EXPECT_EQ(collision::is_certainly_free({&s, 1}, box), is_free)
            << gap_px << ' ' << axis << ' ' << side;
      }
}

// Double represents the height of a triangle down to 1e-12 of its longest edge.
TEST(TriangleView, IsDegenerateBelowATrillionthOfTheLongestEdge) {
  for (const double length_m : {0.25, 1.0, 8.0})
    for (const auto& [ratio, degenerate] : {std::pair{0.9e-12, true}, {1.1e-12, false}}) {
      const collision::Triangle t{kOrigin, Vector3d(length_m, 0, 0),
                                  Vector3d(0.5 * length_m, ratio * length_m, 0)};
      EXPECT_EQ(collision::view_of(t).degenerate, degenerate) << length_m << ' ' << ratio;
    }
}

// Two equal cameras with complementary maps: their hull is empty, but a triangle in the plane of
// the border between both maps is mixed at every size, and every sample is near the border.
TEST(CpuDetection, TestsAtMost1024PartsOfATriangleInDouble) {
  const CollisionHull hull({columns(0, 32), columns(32, 64)});
  const collision::Bvh tree(
      mesh_of({{Vector3d(0, -0.125, 1), Vector3d(0, 0.125, 1), Vector3d(0, 0, 1.125)}}));
  const collision::DetectionObject object{&tree};
  for (const auto& [divisions, over_budget] : {std::pair{32, false}, {64, true}}) {
    const double eps_m = 16 * 0.25 / divisions;
    for (const auto& [spacing_m, samples] : {std::pair{0.0, 0u}, {0.021, 64u}}) {
      collision::CpuDetectionCounts counts;
      const auto found = collision::detect(hull.query, {&object, 1},
                                           {.eps_m = eps_m, .spacing_m = spacing_m}, &counts)[0];
      EXPECT_EQ(found.verdict, collision::CollisionVerdict::undecided);
      EXPECT_EQ(found.undecided, std::vector<std::uint32_t>{0});
      EXPECT_TRUE(found.points.empty());
      // Three corners and the center of each part.
      EXPECT_EQ(counts.points_in_double, samples + 4 * 1024u) << divisions << ' ' << spacing_m;
      EXPECT_EQ(counts.over_budget, std::size_t(over_budget));
    }
  }
}

// Float decides no part of a triangle in a camera's plane. 1024 cuts into four make 3073 parts, of
// which each corner is tested.
TEST(CpuDetection, CutsEachTriangleInto4096PartsAtMost) {
  const CollisionHull hull({columns(0, 64)});
  const collision::Triangle t{Vector3d(0.5, 0.1, 0), Vector3d(0.9, 0.2, 0), Vector3d(0.6, 0.7, 0)};
  const collision::Bvh tree(mesh_of({t, t}));
  const collision::DetectionObject object{&tree};
  for (const double spacing_m : {0.0, 3e-3}) {
    collision::CpuDetectionCounts counts;
    const auto found =
        collision::detect(hull.query, {&object, 1}, {.spacing_m = spacing_m}, &counts)[0];
    EXPECT_EQ(found.verdict, collision::CollisionVerdict::undecided);
    EXPECT_EQ(counts.points_in_double, 2 * 3 * 3073u);
    EXPECT_EQ(counts.over_budget, 2u);
  }
}

// A triangle of 2 cm that may have 100 points gets 64 samples instead of one per 10 um.
TEST(CpuDetection, FewerSamplesThanRequestedAreTruncated) {
  const CollisionHull hull(silhouettes_of({ball(kOrigin, 0.05)}, ring(4, 1.2, 0.6, 300, 0.5)));
  for (const double x_m : {0.0, 0.04}) {  // wholly in the hull, and partly
    const Vector3d p(x_m, 0, 0);
    const collision::Bvh tree(mesh_of({{p, p + Vector3d(0.02, 0, 0), p + Vector3d(0, 0.02, 0)}}));
    const collision::DetectionObject object{&tree};
    for (const bool coarser : {true, false}) {
      const auto found = collision::detect(
          hull.query, {&object, 1},
          {.spacing_m = coarser ? 1e-5 : 2e-3, .max_points = coarser ? 100u : 1000u})[0];
      EXPECT_EQ(found.truncated, coarser);
      EXPECT_GT(found.points.size(), 5u);
      EXPECT_LT(found.points.size(), coarser ? 67u : 200u);
    }
  }
}

TEST(CpuDetection, DefaultsAreHalfAMillimetreThreeMillimetresAnd4096Points) {
  const CollisionHull border({columns(0, 32), columns(32, 64)}),
      full(silhouettes_of({ball(kOrigin, 0.3)}, ring(3, 1.5, 0.6, 100, 1)));
  const collision::Bvh on_border(
      mesh_of({{Vector3d(0, -45e-5, 1), Vector3d(0, 45e-5, 1), Vector3d(0, 0, 1.0003)}})),
      sheet(geometry::curtain_mesh(0.4, 0.4, 12, 12, 0, 1));
  const auto points_in_double = [&](const collision::DetectionOptions& options) {
    const collision::DetectionObject object{&on_border};
    collision::CpuDetectionCounts counts;
    collision::detect(border.query, {&object, 1}, options, &counts);
    return std::pair(counts.points_in_double, counts.over_budget);
  };
  EXPECT_EQ(points_in_double({}), points_in_double({.eps_m = 0.5e-3}));
  EXPECT_NE(points_in_double({}), points_in_double({.eps_m = 1e-3}));
  EXPECT_NE(points_in_double({}), points_in_double({.eps_m = 0.25e-3}));
  const auto points = [&](const collision::DetectionOptions& options) {
    const collision::DetectionObject object{&sheet, at({0, 0.2, 0})};
    return collision::detect(full.query, {&object, 1}, options)[0].points.size();
  };
  EXPECT_EQ(points({}), 4096u);
  EXPECT_EQ(points({.max_points = 100'000}), points({.spacing_m = 3e-3, .max_points = 100'000}));
  EXPECT_NE(points({.max_points = 100'000}), points({.spacing_m = 6e-3, .max_points = 100'000}));
  EXPECT_GT(points({.max_points = 100'000}), 8192u);
}

// A ball in each of 27 cells of a box, and beside each face at 9 places. The box is not cubic, and
// its center is not the origin of the object's frame.
TEST(MayHoldHull, FindsABallInAnyCellAndNoneBesideTheBox) {
  std::vector<geometry::Camera> cameras = ring(5, 1.2, 0.5, 100, 1.0);
  for (const geometry::Camera& c : ring(4, 1.2, -0.4, 100, 1.0)) cameras.push_back(c);
  cameras.push_back(camera_at({0.01, 0, 1.2}, 100, 1.0));
  const Vector3d size_m(0.24, 0.32, 0.4), shift_m(0.3, -0.2, 0.1);
  geometry::Mesh mesh = geometry::box_mesh(size_m);
  for (Vector3d& v : mesh.vertices_m) v += shift_m;
  const collision::Bvh tree(mesh);
  const collision::DetectionObject object{&tree, at(-shift_m)};
  const auto holds = [&](const Vector3d& center_m) {
    const CollisionHull hull(silhouettes_of({ball(center_m, 0.006)}, cameras));
    return collision::may_hold_hull(collision::object_maps(hull.query, object), tree);
  };
  const double places[] = {-7.0 / 16, 1.0 / 16, 7.0 / 16};  // centers of cells
  for (const double x : places)
    for (const double y : places) {
      for (const double z : places)
        EXPECT_TRUE(holds(size_m.cwiseProduct(Vector3d(x, y, z)))) << x << ' ' << y << ' ' << z;
      for (Eigen::Index axis = 0; axis < 3; ++axis)
        for (const double side : {-1.0, 1.0}) {
          Vector3d p;
          p[axis] = side * (0.5 * size_m[axis] + 0.05);
          p[(axis + 1) % 3] = x * size_m[(axis + 1) % 3];
          p[(axis + 2) % 3] = y * size_m[(axis + 2) % 3];
          EXPECT_FALSE(holds(p)) << p.transpose();
        }
    }
}

// Float cannot represent pixels in an image of 70,000 columns. Each camera alone sees the first
// triangle wholly on object pixels; both see only the second one.
TEST(CpuDetection, ACameraTooWideForFloatStillLimitsTheHull) {
  hull::Silhouette wide{{{70'000, 64, 64, 64, 34'999.5, 31.5}, Isometry3d::Identity()},
                        hull::ObjectPixels(70'000, 64)};
  for (int v = 0; v < 64; ++v) {
    wide.pixels.set_run(0, 10, v);
    wide.pixels.set_run(35'010, 70'000, v);  // x > 10 / 64 at a depth of 1 m
  }
  const CollisionHull hull({columns(0, 64), wide});
  const auto triangle_at = [](double x_m) {
    const Vector3d p(x_m, 0, 1);
    return collision::Triangle{p, p + Vector3d(0.02, 0, 0), p + Vector3d(0, 0.02, 0)};
  };
  const collision::Bvh tree(mesh_of({triangle_at(0.05), triangle_at(0.25)}));
  const collision::DetectionObject object{&tree};
  ASSERT_EQ(collision::object_maps(hull.query, object).size(), 1u);
  for (const double spacing_m : {0.0, 3e-3}) {
    const auto found = collision::detect(hull.query, {&object, 1}, {.spacing_m = spacing_m})[0];
    EXPECT_EQ(found.triangles, std::vector<std::uint32_t>{1});
    EXPECT_TRUE(found.undecided.empty());
  }
  // No box is certified without the wide camera's map.
  const collision::Bvh beside(mesh_of({triangle_at(0.05)}));
  const collision::DetectionObject free{&beside};
  const auto found = collision::detect(hull.query, {&free, 1})[0];
  EXPECT_EQ(found.verdict, collision::CollisionVerdict::free);
  EXPECT_TRUE(found.hull_in_box);
}

// The margins of contact_maps.cpp: at least the errors that its table derives, and at most 5 %
// more. e is half a unit in the last place of float.
TEST(ContactMaps, MarginsAreTheDerivedErrors) {
  constexpr double e = 0x1p-24, kSlack = 1.05, kProjection = 32 * 0x1p-52;
  Random random(22);
  for (int scene = 0; scene < 60; ++scene) {
    const double far_m = scene % 3 == 2 ? 1e6 : 1;
    const int width = 100 + int(uniform(random, 0, 400)), height = 90;
    hull::CpuHull::MapCamera camera;
    camera.camera = random_camera(random, width, height);
    const Vector3d shift_m = far_m * random_direction(random);
    camera.camera.camera_from_world = camera.camera.camera_from_world * at(-shift_m);
    hull::ObjectPixels pixels(width, height);
    for (int i = 0; i < 3; ++i)
      pixels.set(int(uniform(random, 0, width)), int(uniform(random, 0, height)));
    camera.skip_map.assign(pixels);
    camera.skip_map.make(hull::Quadrant::right_down);
    const hull::PixelRect bounds = pixels.bounds();
    const geometry::Pinhole& k = camera.camera.pinhole;
    Eigen::Matrix3d image;  // to (U, V, W), of pixels that begin at whole numbers
    image << k.fx_px, 0, k.cx_px + 0.5, 0, k.fy_px, k.cy_px + 0.5, 0, 0, 1;
    const Isometry3d& pose = camera.camera.camera_from_world;
    const Eigen::Matrix3d of_world = image * pose.linear();
    const Vector3d at_world = image * pose.translation();
    // Sizes of the terms of U, V and W in the world.
    const auto world_terms = [&](const Vector3d& p, double radius_m) -> Vector3d {
      return of_world.cwiseAbs() * (p.cwiseAbs() + Vector3d::Constant(radius_m)) +
             at_world.cwiseAbs();
    };
    const auto of_projection = [&](const Vector3d& terms, double image_px) {
      return kProjection * (std::max(terms.x(), terms.y()) + image_px * terms.z());
    };

    Isometry3d world_from_tree = at(shift_m + random_in_ball(random, 0.2));
    world_from_tree.linear() =
        Eigen::AngleAxisd(uniform(random, 0, 3), random_direction(random)).toRotationMatrix();
    const double radius_m = uniform(random, 0.05, 0.5);
    const auto map = collision::object_map(camera, world_from_tree, radius_m);
    ASSERT_TRUE(map);
    const double base_u = bounds.u0_px - double(map->begin_u),
                 base_v = bounds.v0_px - double(map->begin_v);
    EXPECT_EQ(map->end_u, float(bounds.u1_px - base_u));
    EXPECT_EQ(map->end_v, float(bounds.v1_px - base_v));
    Eigen::Matrix3d to_base = Eigen::Matrix3d::Identity();
    to_base(0, 2) = -base_u, to_base(1, 2) = -base_v;
    const Eigen::Matrix3d of = to_base * of_world * world_from_tree.linear();
    const Vector3d from_world = of_world * world_from_tree.translation() + at_world,
                   at_tree = to_base * from_world,
                   terms = at_tree.cwiseAbs() + radius_m * of.cwiseAbs().rowwise().sum();
    for (int row = 0; row < 3; ++row) {
      EXPECT_NEAR(map->at[row], at_tree[row], 1e-6 * terms[row] + 1e-9 * far_m);
      for (int axis = 0; axis < 3; ++axis)
        EXPECT_NEAR(map->of[row][axis], of(row, axis), 1e-6 * terms[row] / radius_m);
    }
    const double farthest_px = 0.5 * std::max(bounds.width_px(), bounds.height_px()) + 1,
                 image_px = std::max(std::abs(base_u), std::abs(base_v)) + farthest_px,
                 projection =
                     of_projection(world_terms(world_from_tree.translation(), radius_m), image_px),
                 w_error_m = 12 * e * terms.z() + projection,
                 error_px_m = 12 * e * (std::max(terms.x(), terms.y()) + farthest_px * terms.z()) +
                              projection;
    EXPECT_EQ(map->eps_px, 1.0f / 64);
    EXPECT_GE(map->slack_w, w_error_m * (1 - 1e-6));
    EXPECT_LE(map->slack_w, w_error_m * kSlack);
    EXPECT_FLOAT_EQ(map->max_behind_w, -2 * map->slack_w);
    const double per_w_px = 1.0 / 64 - 8 * e * farthest_px;
    EXPECT_GE(map->min_w * per_w_px, error_px_m * (1 - 1e-6));
    EXPECT_LE(map->min_w * per_w_px, error_px_m * kSlack);

    const Isometry3d world_from_camera = pose.inverse();
    std::array<Vector3d, 3> vertices_world_m, uvw;
    collision::TriangleMap triangle;
    for (Vector3d& v : vertices_world_m)
      v = world_from_camera *
          Vector3d(uniform(random, -0.2, 0.2), uniform(random, -0.2, 0.2), uniform(random, 0.8, 2));
    if (collision::triangle_map(collision::pixel_from_world(camera.camera), camera.skip_map,
                                vertices_world_m, 8,
                                triangle) != collision::ProjectionStatus::in_front)
      continue;
    to_base(0, 2) = -(bounds.u0_px - double(triangle.begin_u));
    to_base(1, 2) = -(bounds.v0_px - double(triangle.begin_v));
    double nearest_m = 1e9, off_px = 1, on_image_px = 0;
    Vector3d largest = Vector3d::Zero();
    for (std::size_t i = 0; i < 3; ++i) {
      const Vector3d p = of_world * vertices_world_m[i] + at_world;
      on_image_px = std::max(on_image_px, p.head<2>().cwiseAbs().maxCoeff() / p.z());
      uvw[i] = to_base * p;
      off_px = std::max(off_px, uvw[i].head<2>().cwiseAbs().maxCoeff() / uvw[i].z());
      nearest_m = std::min(nearest_m, p.z());
      largest = largest.cwiseMax(world_terms(vertices_world_m[i], 0));
    }
    const Vector3d sizes =
        uvw[0].cwiseAbs() + (uvw[1] - uvw[0]).cwiseAbs() + (uvw[2] - uvw[0]).cwiseAbs();
    const double eps_px = (10 * e * (std::max(sizes.x(), sizes.y()) + off_px * sizes.z()) +
                           of_projection(largest, on_image_px)) /
                              nearest_m +
                          8 * e * off_px;
    EXPECT_GE(triangle.eps_px, eps_px * (1 - 1e-6)) << scene;
    EXPECT_LE(triangle.eps_px, eps_px * kSlack) << scene;
    for (int row = 0; row < 3; ++row) {
      const double rounding = 1e-6 * sizes[row] + 1e-9 * far_m;
      EXPECT_NEAR(triangle.at[row], uvw[0][row], rounding);
      EXPECT_NEAR(8 * triangle.by_a[row], uvw[1][row] - uvw[0][row], rounding);
      EXPECT_NEAR(8 * triangle.by_b[row], uvw[2][row] - uvw[0][row], rounding);
    }
  }
}

}  // namespace
}  // namespace fivepipe::test
