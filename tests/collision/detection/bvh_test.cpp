// The bounding volume hierarchy of a mesh's triangles.
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

#include "common/collision/detection/bvh.h"
#include "tests/support/collision_scene.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

bool in_box(const collision::Bvh::Boxes& boxes, int child, const Vector3d& p_m) {
  for (int axis = 0; axis < 3; ++axis)
    if (!(std::abs(p_m[axis] - double(boxes.center_m[std::size_t(axis)][std::size_t(child)])) <=
          double(boxes.half_m[std::size_t(axis)][std::size_t(child)])))
      return false;
  return true;
}

// Expects every vertex of every triangle in the box of its leaf and of each node above it.
void expect_boxes_contain_triangles(const collision::Bvh& tree) {
  std::set<std::uint32_t> seen;
  for (int leaf = 0; leaf < tree.leaves(); ++leaf)
    for (const std::uint32_t t : tree.triangles_of(leaf)) {
      EXPECT_TRUE(seen.insert(t).second);
      for (const std::uint32_t v : tree.mesh().triangles[t]) {
        const Vector3d p_m = tree.mesh().vertices_m[v] - tree.origin_m();
        EXPECT_LE(p_m.norm(), tree.radius_m());
        for (int level = 0, node = leaf; level < tree.levels();
             ++level, node /= collision::Bvh::kArity)
          ASSERT_TRUE(in_box(tree.boxes(level, node / collision::Bvh::kArity),
                             node % collision::Bvh::kArity, p_m))
              << level;
      }
    }
  EXPECT_EQ(seen.size(), tree.mesh().triangles.size());
  if (!tree.empty()) {
    EXPECT_EQ(tree.levels() > 1, tree.leaves() > collision::Bvh::kArity);
  }
}

TEST(Bvh, EveryBoxContainsItsTriangles) {
  for (const geometry::Mesh& mesh : {geometry::box_mesh({1, 0.2, 3}), geometry::sphere_mesh(0.1, 0),
                                     geometry::sphere_mesh(0.1, 1), geometry::sphere_mesh(0.1, 4),
                                     geometry::curtain_mesh(1, 0.8, 20, 18, 0.05, 4),
                                     geometry::curtain_mesh(0.001, 1000, 40, 90, 0, 1)})
    expect_boxes_contain_triangles(collision::Bvh(mesh));
}

TEST(Bvh, EveryBoxContainsItsTrianglesFarFromTheOriginAndAfterARefit) {
  Random random(1);
  geometry::Mesh mesh = geometry::sphere_mesh(0.1, 3);
  for (Vector3d& v : mesh.vertices_m) v += Vector3d(1e6, -3e5, 12345.678);
  collision::Bvh tree(mesh);
  expect_boxes_contain_triangles(tree);
  for (Vector3d& v : mesh.vertices_m) v += random_in_ball(random, 5);
  tree.refit(mesh.vertices_m);
  expect_boxes_contain_triangles(tree);
}

TEST(Bvh, AcceptsAnEmptyMeshAndATriangleOfOnePoint) {
  EXPECT_TRUE(collision::Bvh(geometry::Mesh{}).empty());
  expect_boxes_contain_triangles(collision::Bvh(geometry::Mesh{{Vector3d(1, 2, 3)}, {{0, 0, 0}}}));
}

TEST(Bvh, RejectsAVertexThatIsNotFinite) {
  const geometry::Mesh mesh = geometry::box_mesh({0.1, 0.1, 0.1});
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    geometry::Mesh broken = mesh;
    broken.vertices_m[3].y() = bad;
    EXPECT_THROW(collision::Bvh{broken}, std::invalid_argument);
    collision::Bvh tree(mesh);
    EXPECT_THROW(tree.refit(broken.vertices_m), std::invalid_argument);
    EXPECT_TRUE(tree.mesh().vertices_m[3].allFinite());  // a rejected refit changes nothing
  }
}

TEST(Bvh, RejectsAMissingVertexAndARefitWithAnotherNumberOfVertices) {
  geometry::Mesh mesh = geometry::box_mesh({0.1, 0.1, 0.1});
  collision::Bvh tree(mesh);
  std::vector<Vector3d> fewer = mesh.vertices_m;
  fewer.pop_back();
  EXPECT_THROW(tree.refit(fewer), std::invalid_argument);
  mesh.triangles.push_back({0, 1, 99});
  EXPECT_THROW(collision::Bvh{mesh}, std::invalid_argument);
}

}  // namespace
}  // namespace fivepipe::test
