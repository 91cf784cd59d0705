// The tree of boxes over a mesh's triangles.
#include <cmath>
#include <set>

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

// Every vertex of every triangle lies in the box of its leaf, and of every node above.
void expect_boxes_hold(const collision::Bvh& tree) {
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
    EXPECT_EQ(tree.leaves() <= collision::Bvh::kArity ? 1 : tree.levels() > 1, true);
  }
}

TEST(Bvh, EveryBoxContainsItsTriangles) {
  for (const geometry::Mesh& mesh : {geometry::box_mesh({1, 0.2, 3}), geometry::sphere_mesh(0.1, 0),
                                     geometry::sphere_mesh(0.1, 1), geometry::sphere_mesh(0.1, 4),
                                     geometry::curtain_mesh(1, 0.8, 20, 18, 0.05, 4),
                                     geometry::curtain_mesh(0.001, 1000, 40, 90, 0, 1)})
    expect_boxes_hold(collision::Bvh(mesh));
}

TEST(Bvh, EveryBoxContainsItsTrianglesFarFromTheOriginAndAfterRefit) {
  Random random(1);
  geometry::Mesh mesh = geometry::sphere_mesh(0.1, 3);
  for (Vector3d& v : mesh.vertices_m) v += Vector3d(1e6, -3e5, 12345.678);
  collision::Bvh tree(mesh);
  expect_boxes_hold(tree);
  for (Vector3d& v : mesh.vertices_m) v += random_in_ball(random, 5);
  tree.refit(mesh.vertices_m);
  expect_boxes_hold(tree);
}

TEST(Bvh, SinglePointAndEmptyMesh) {
  EXPECT_TRUE(collision::Bvh(geometry::Mesh{}).empty());
  expect_boxes_hold(collision::Bvh(geometry::Mesh{{Vector3d(1, 2, 3)}, {{0, 0, 0}}}));
}

}  // namespace
}  // namespace fivepipe::test
