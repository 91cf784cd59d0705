// The patches of an object's surface in the hull of a real block with a flat top at z = 0.
#include "common/collision/response/contact_patch.h"

#include <numeric>

#include "tests/support/collision/scene.h"
#include "tests/support/hull/queries.h"
#include "tests/support/hull/tangent_cones.h"
#include "tests/support/not_finite.h"

namespace fivepipe::test {
namespace {

using collision::contact_patches;
using collision::ContactPatch;
using Eigen::Vector3d;

// Pixels of 2 mm.
std::vector<hull::Silhouette> block() {
  return silhouettes_of_box(
      Eigen::AlignedBox3d(Vector3d(-0.08, -0.08, -0.1), Vector3d(0.08, 0.08, 0)),
      ring(5, 1.5, 0, 300, 0.6));
}

std::vector<std::uint32_t> all_triangles(const geometry::Mesh& mesh) {
  std::vector<std::uint32_t> triangles(mesh.triangles.size());
  std::iota(triangles.begin(), triangles.end(), 0u);
  return triangles;
}

std::vector<ContactPatch> patches_of(const geometry::Mesh& mesh, const Eigen::Isometry3d& pose,
                                     const collision::PatchOptions& options = {}) {
  static const Queries hull(block());
  return contact_patches(hull.query, mesh, pose, all_triangles(mesh), options);
}

Eigen::Isometry3d placed(const Vector3d& place_m, double turn_rad = 0) {
  return Eigen::Translation3d(place_m) *
         Eigen::Isometry3d(Eigen::AngleAxisd(turn_rad, Vector3d::UnitX()));
}

TEST(ContactPatches, ABoxOnTheBlockHasOnePatchWithTheBlocksNormal) {
  const geometry::Mesh box = geometry::box_mesh({0.06, 0.04, 0.05}, 0);
  for (const double turn_rad : {0.0, 0.05}) {
    const auto patches = patches_of(box, placed({0.01, 0, 0.025 - 0.005}, turn_rad));
    ASSERT_EQ(patches.size(), 1u);
    EXPECT_LT(between_deg(patches[0].normal_world, Vector3d::UnitZ()), 3) << turn_rad;
    EXPECT_NEAR(patches[0].normal_world.norm(), 1, 1e-12);
    // The lower face and 5 mm of the sides.
    if (turn_rad == 0) {
      EXPECT_NEAR(patches[0].area_m2, 0.06 * 0.04 + 2 * 0.005 * (0.06 + 0.04), 4e-4);
    }
    for (const Vector3d& p_m : patches[0].points_world_m) EXPECT_LT(p_m.z(), 0.003);
  }
}

TEST(ContactPatches, PartsThatAreApartArePatchesOfTheirOwn) {
  // A bridge: two feet of different size.
  geometry::Mesh feet = geometry::box_mesh({0.04, 0.04, 0.05}, 0);
  const geometry::Mesh small = geometry::box_mesh({0.02, 0.02, 0.05}, 0);
  for (Vector3d& vertex : feet.vertices_m) vertex.x() -= 0.04;
  const auto offset = std::uint32_t(feet.vertices_m.size());
  for (Vector3d vertex : small.vertices_m) {
    vertex.x() += 0.04;
    feet.vertices_m.push_back(vertex);
  }
  for (auto triangle : small.triangles) {
    for (auto& corner : triangle) corner += offset;
    feet.triangles.push_back(triangle);
  }
  const auto patches = patches_of(feet, placed({0, 0, 0.02}));
  ASSERT_EQ(patches.size(), 2u);
  EXPECT_GT(patches[0].area_m2, 2 * patches[1].area_m2) << "by descending area";
  EXPECT_LT(patches[0].points_world_m.front().x(), 0);
  EXPECT_GT(patches[1].points_world_m.front().x(), 0);
  EXPECT_EQ(patches_of(feet, placed({0, 0, 0.02}), {.gap_m = 0.1}).size(), 1u);
}

TEST(ContactPatches, NoSurfaceInTheHullAndAPlateThroughItHaveNone) {
  const geometry::Mesh box = geometry::box_mesh({0.06, 0.04, 0.05}, 0);
  EXPECT_TRUE(patches_of(box, placed({0, 0, 0.06})).empty()) << "above the block";
  EXPECT_TRUE(patches_of(box, placed({0, 0, -0.05})).empty()) << "wholly in the block";
  const geometry::Mesh plate = geometry::box_mesh({0.3, 0.3, 0.001}, 0);
  EXPECT_TRUE(patches_of(plate, placed({0, 0, -0.05})).empty()) << "both sides cancel";
}

TEST(ContactPatches, TheOrderOfTrianglesDoesNotMatter) {
  const geometry::Mesh box = geometry::box_mesh({0.06, 0.04, 0.05}, 0.01);
  const auto pose = placed({0.01, 0, 0.02}, 0.03);
  static const Queries hull(block());
  std::vector<std::uint32_t> triangles = all_triangles(box);
  const auto first = contact_patches(hull.query, box, pose, triangles);
  Random random(4);
  std::shuffle(triangles.begin(), triangles.end(), random);
  const auto shuffled = contact_patches(hull.query, box, pose, triangles);
  ASSERT_EQ(first.size(), 1u);
  ASSERT_EQ(shuffled.size(), 1u);
  EXPECT_LT((first[0].normal_world - shuffled[0].normal_world).norm(), 1e-12);
  EXPECT_NEAR(first[0].area_m2, shuffled[0].area_m2, 1e-12);
  EXPECT_EQ(first[0].points_world_m.size(), shuffled[0].points_world_m.size());
}

// At most kMaxPatchCells cells, however large the object is.
TEST(ContactPatches, LimitsTheNumberOfCells) {
  const geometry::Mesh box = geometry::box_mesh({0.15, 0.15, 0.15}, 0);
  const auto patches = patches_of(box, placed({0, 0, 0.07}), {.cell_m = 1e-5});
  ASSERT_EQ(patches.size(), 1u);
  EXPECT_LE(patches[0].points_world_m.size(), 1.2 * double(collision::kMaxPatchCells));
  EXPECT_LT(between_deg(patches[0].normal_world, Vector3d::UnitZ()), 3);
}

TEST(ContactPatches, RefusesOptionsAndPosesOutOfRange) {
  const geometry::Mesh box = geometry::box_mesh({0.06, 0.04, 0.05}, 0);
  const auto pose = placed({0, 0, 0.02});
  EXPECT_THROW(patches_of(box, pose, {.cell_m = 0}), std::invalid_argument);
  EXPECT_THROW(patches_of(box, pose, {.gap_m = -1}), std::invalid_argument);
  for (const double bad : {kNaN, kInfinity}) {
    EXPECT_THROW(patches_of(box, pose, {.cell_m = bad}), std::invalid_argument);
    EXPECT_THROW(patches_of(box, pose, {.gap_m = bad}), std::invalid_argument);
    EXPECT_THROW(patches_of(box, placed({0, bad, 0})), std::invalid_argument);
  }
}

}  // namespace
}  // namespace fivepipe::test
