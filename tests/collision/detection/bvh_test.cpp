// The bounding volume hierarchy of a mesh's triangles.
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>
#include <vector>

#include "common/collision/detection/bvh.h"
#include "tests/support/collision/scene.h"

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

// A box reaches at most three units in the last place beyond its triangles: two of its own, and one
// of its center's rounding.
TEST(Bvh, BoxesAreTightAndAbsentOnesAreMarked) {
  for (const geometry::Mesh& mesh :
       {geometry::box_mesh({1, 0.2, 3}), geometry::sphere_mesh(0.1, 1),
        geometry::sphere_mesh(0.1, 4), geometry::curtain_mesh(1, 0.8, 20, 18, 0.05, 4)}) {
    const collision::Bvh tree(mesh);
    EXPECT_EQ(tree.leaves(), int((mesh.triangles.size() + 15) / 16));
    int below = tree.leaves();
    for (int level = 0, leaves_per_box = 1; level < tree.levels(); ++level, leaves_per_box *= 16) {
      const int nodes = (below + 15) / 16;
      for (int child = 0; child < 16 * nodes; ++child) {
        const collision::Bvh::Boxes& boxes = tree.boxes(level, child / 16);
        const auto slot = std::size_t(child % 16);
        Eigen::AlignedBox3d bounds;
        for (int leaf = child * leaves_per_box;
             leaf < std::min(tree.leaves(), (child + 1) * leaves_per_box); ++leaf)
          for (const std::uint32_t t : tree.triangles_of(leaf))
            for (const std::uint32_t v : mesh.triangles[t])
              bounds.extend(mesh.vertices_m[v] - tree.origin_m());
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const double half_m = boxes.half_m[axis][slot], center_m = boxes.center_m[axis][slot];
          if (child >= below) {
            EXPECT_EQ(half_m, -1);
            EXPECT_EQ(center_m, 0);
            continue;
          }
          const auto k = Eigen::Index(axis);
          const double rounding_m = 0x1p-22 * bounds.max().cwiseMax(-bounds.min())[k] + 1e-44;
          EXPECT_LE(half_m, 0.5 * bounds.sizes()[k] + rounding_m) << level;
          EXPECT_NEAR(center_m, bounds.center()[k], rounding_m) << level;
        }
      }
      below = nodes;
    }
    EXPECT_EQ(below, 1);
    const Eigen::AlignedBox3d all = geometry::bounds_m(mesh);
    EXPECT_EQ(tree.origin_m(), all.center());
    EXPECT_LE(tree.radius_m(), 0.5 * all.diagonal().norm() * (1 + 1e-14));
  }
}

TEST(Bvh, LeavesHoldTheirVerticesInFloatAndAbsentOnesAreNaN) {
  const geometry::Mesh mesh = geometry::sphere_mesh(0.1, 1);  // 80 triangles: 5 leaves
  geometry::Mesh fewer = mesh;
  fewer.triangles.resize(70);
  for (const geometry::Mesh& m : {mesh, fewer}) {
    const collision::Bvh tree(m);
    ASSERT_EQ(tree.leaves(), 5);
    for (int leaf = 0; leaf < 5; ++leaf) {
      const auto triangles = tree.triangles_of(leaf);
      EXPECT_EQ(triangles.size(), leaf < 4 ? 16 : m.triangles.size() - 64);
      for (std::size_t i = 0; i < 16; ++i)
        for (std::size_t k = 0; k < 3; ++k)
          for (std::size_t axis = 0; axis < 3; ++axis) {
            const float x = tree.leaf(leaf).vertices_m[k][axis][i];
            if (i >= triangles.size()) {
              EXPECT_TRUE(std::isnan(x));
              continue;
            }
            const Vector3d p_m = m.vertices_m[m.triangles[triangles[i]][k]] - tree.origin_m();
            EXPECT_EQ(x, float(p_m[Eigen::Index(axis)]));
          }
    }
  }
}

// Along the curve, the point of which the highest differing bit of x, y or z is set comes later; of
// equally high bits that of z decides, then y.
TEST(Bvh, TrianglesFollowTheMortonCurve) {
  Random random(4);
  geometry::Mesh mesh;
  for (std::uint32_t i = 0; i < 500; ++i) {
    const Vector3d p{uniform(random, 0, 1), uniform(random, 0, 0.5), uniform(random, 0, 1)};
    mesh.vertices_m.push_back(p);
    mesh.triangles.push_back({i, i, i});
  }
  const collision::Bvh tree(mesh);
  const Eigen::AlignedBox3d bounds = geometry::bounds_m(mesh);
  const auto code = [&](std::uint32_t t) {
    const Vector3d p = (3 * mesh.vertices_m[t] / 3 - bounds.min()) / bounds.sizes().maxCoeff();
    std::vector<bool> bits;
    for (int bit = 20; bit >= 0; --bit)
      for (int axis = 2; axis >= 0; --axis)
        bits.push_back(std::uint32_t(p[axis] * ((1 << 21) - 1)) >> bit & 1);
    return bits;
  };
  std::vector<std::uint32_t> order;
  for (int leaf = 0; leaf < tree.leaves(); ++leaf)
    for (const std::uint32_t t : tree.triangles_of(leaf)) order.push_back(t);
  ASSERT_EQ(order.size(), 500u);
  for (std::size_t i = 1; i < order.size(); ++i) EXPECT_LT(code(order[i - 1]), code(order[i])) << i;
}

TEST(Bvh, EachConstructionAndRefitHasTheNextContent) {
  const geometry::Mesh mesh = geometry::box_mesh({0.1, 0.1, 0.1});
  EXPECT_EQ(collision::Bvh().content(), 0u);
  EXPECT_EQ(collision::Bvh(geometry::Mesh{}).content(), 0u);
  collision::Bvh first(mesh);
  const std::uint64_t number = first.content();
  EXPECT_GT(number, 0u);
  EXPECT_EQ(collision::Bvh(mesh).content(), number + 1);
  first.refit(mesh.vertices_m);
  EXPECT_EQ(first.content(), number + 2);
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
  for (const std::uint32_t missing : {8u, 99u}) {  // the box has 8 vertices
    geometry::Mesh broken = mesh;
    broken.triangles.push_back({0, 1, missing});
    EXPECT_THROW(collision::Bvh{broken}, std::invalid_argument);
  }
}

}  // namespace
}  // namespace fivepipe::test
