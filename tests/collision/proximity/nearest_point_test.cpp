// The nearest point of a mesh against a search of all its triangles.
#include "common/collision/proximity/nearest_point.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "common/collision/proximity/proximity_shapes.h"
#include "tests/support/hull/scenes.h"
#include "tests/support/not_finite.h"

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

geometry::Mesh random_mesh(test::Random& random, int triangles, double size_m) {
  geometry::Mesh mesh;
  for (int i = 0; i < triangles; ++i) {
    const Vector3d at_m = test::random_in_ball(random, 1);
    for (int corner = 0; corner < 3; ++corner)
      mesh.vertices_m.push_back(at_m + test::random_in_ball(random, size_m));
    const auto first = std::uint32_t(3 * i);
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  return mesh;
}

double distance_m(const geometry::Mesh& mesh, const Vector3d& p_m) {
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const auto& [a, b, c] : mesh.triangles)
    nearest_m = std::min(
        nearest_m, (TriangleShape({mesh.vertices_m[a], mesh.vertices_m[b], mesh.vertices_m[c]})
                        .nearest_to(p_m) -
                    p_m)
                       .norm());
  return nearest_m;
}

TEST(NearestPoint, IsTheNearestOfAllTriangles) {
  test::Random random(5);
  for (const int triangles : {1, 16, 17, 300, 5000}) {
    const geometry::Mesh mesh = random_mesh(random, triangles, 0.1);
    const Bvh tree(mesh);
    for (int i = 0; i < 200; ++i) {
      const Vector3d p_m = test::random_in_ball(random, 1.5);
      const auto found = nearest_point(tree, p_m, 10);
      ASSERT_TRUE(found);
      EXPECT_EQ(found->distance_m, distance_m(mesh, p_m));
      EXPECT_EQ((found->p_m - p_m).norm(), found->distance_m);
      const auto& [a, b, c] = mesh.triangles[found->triangle];
      EXPECT_EQ(TriangleShape({mesh.vertices_m[a], mesh.vertices_m[b], mesh.vertices_m[c]})
                    .nearest_to(p_m),
                found->p_m);
    }
  }
}

TEST(NearestPoint, IsWithinReachOrNone) {
  test::Random random(6);
  const geometry::Mesh mesh = random_mesh(random, 200, 0.05);
  const Bvh tree(mesh);
  int near = 0;
  for (int i = 0; i < 1000; ++i) {
    const Vector3d p_m = test::random_in_ball(random, 1.2);
    const bool is_near = distance_m(mesh, p_m) <= 0.1;
    near += is_near;
    EXPECT_EQ(nearest_point(tree, p_m, 0.1).has_value(), is_near);
  }
  EXPECT_GT(near, 100);
  EXPECT_LT(near, 900);
}

// Far from the origin, the tree's float coordinates are relative to its own origin.
TEST(NearestPoint, IsFoundFarFromTheOriginAndOnDegenerateTriangles) {
  const Vector3d far_m(1e4, -2e4, 3e3);
  geometry::Mesh mesh;
  mesh.vertices_m = {far_m, far_m + Vector3d(1, 0, 0), far_m + Vector3d(2, 0, 0)};
  mesh.triangles = {{0, 1, 2}, {0, 0, 0}};
  const auto found = nearest_point(Bvh(mesh), far_m + Vector3d(0.5, 0.25, 0), 1);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->distance_m, 0.25, 1e-9);
}

TEST(NearestPoint, IsNoneWithoutTrianglesAndForNaN) {
  EXPECT_FALSE(nearest_point(Bvh(), {0, 0, 0}, 1));
  geometry::Mesh mesh;
  mesh.vertices_m = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  const Bvh tree(mesh);
  for (const double bad : {test::kNaN, test::kInfinity, -test::kInfinity})
    for (int axis = 0; axis < 3; ++axis) {
      Vector3d p_m(0.2, 0.2, 0);
      p_m[axis] = bad;
      EXPECT_FALSE(nearest_point(tree, p_m, 1));
    }
}

}  // namespace
}  // namespace fivepipe::collision
