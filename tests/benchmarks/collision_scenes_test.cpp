// The scenes of the collision benchmark are as documented, and their truth is correct.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "benchmarks/collision/truth.h"
#include "common/collision/oracle/triangle_reference.h"

namespace fivepipe::collision_bench {
namespace {

using Eigen::Vector3d;

TruthCounts true_counts(const CollisionScene& scene) {
  base::WorkerPool pool(1);
  return counts_of(exact_truth(scene, pool));
}

TEST(CollisionScenes, HandPressesThroughThePapersCurtain) {
  const CollisionScene scene = curtain720();
  EXPECT_EQ(scene.triangles(), 720u);
  EXPECT_EQ(scene.silhouettes.size(), 3u);
  const auto counts = true_counts(scene);
  EXPECT_GE(double(counts.crossing_border), 72);
  // The curtain hangs in the plane y = 0, and the real hand is on both sides of it.
  double beyond_m = 0, before_m = 0;
  for (const hull::Capsule& c : scene.real_objects)
    for (const Vector3d* end : {&c.a_world_m, &c.b_world_m})
      beyond_m = std::max(beyond_m, end->y() + c.radius_m),
      before_m = std::min(before_m, end->y() - c.radius_m);
  EXPECT_GE(beyond_m, 0.05);
  EXPECT_LT(before_m, 0);
}

TEST(CollisionScenes, HandTouchesSomeOfTwelveBlocks) {
  const CollisionScene scene = blocks();
  ASSERT_EQ(scene.objects.size(), 12u);
  base::WorkerPool pool(1);
  int touched = 0;
  for (const auto& object : exact_truth(scene, pool))
    touched += std::any_of(object.begin(), object.end(), [](const auto& t) { return t.crosses; });
  EXPECT_GE(touched, 3);
  EXPECT_LE(touched, 9);
}

TEST(CollisionScenes, PayloadHasFiftyThousandTrianglesInClosedParts) {
  const CollisionScene scene = payload();
  EXPECT_GE(scene.triangles(), 50000u);
  EXPECT_LT(scene.triangles(), 50044u);
  EXPECT_GT(true_counts(scene).crossing_border, 100u);
  // A closed mesh traverses each edge equally often in both directions.
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> directed;
  for (const auto& t : scene.objects[0].mesh.triangles)
    for (int i = 0; i < 3; ++i) ++directed[{t[i], t[(i + 1) % 3]}];
  for (const auto& [edge, count] : std::map(directed))
    ASSERT_EQ(count, (directed[{edge.second, edge.first}]));
}

TEST(CollisionScenes, EightInAThousandOfDensesMillionTrianglesAreNear) {
  const CollisionScene scene = dense();
  EXPECT_EQ(scene.triangles(), 1000000u);
  const auto counts = true_counts(scene);
  EXPECT_NEAR(double(counts.near), 8000, 1000);
  EXPECT_GT(counts.crossing, 100u);
}

TEST(CollisionScenes, EveryTriangleOfFullCrossesTheBorder) {
  const CollisionScene scene = full();
  const auto counts = true_counts(scene);
  EXPECT_EQ(counts.crossing_border, counts.triangles);
  EXPECT_EQ(counts.triangles, 80u);
}

TEST(CollisionScenes, ThinHasTwoMillimetreFingersAndTwoCentimetreTriangles) {
  const CollisionScene scene = thin();
  for (const hull::Capsule& c : scene.real_objects) EXPECT_EQ(c.radius_m, 0.001);
  for (const collision::Triangle& t : scene.objects_world_m[0])
    EXPECT_NEAR((t[1] - t[0]).cross(t[2] - t[0]).norm(), 0.02 * 0.02, 1e-12);
  EXPECT_GE(true_counts(scene).crossing_border, scene.real_objects.size());
}

TEST(CollisionScenes, AreDeterministic) {
  const CollisionScene one = payload(), two = payload();
  EXPECT_EQ(one.objects_world_m, two.objects_world_m);
  EXPECT_EQ(one.silhouettes[0].pixels, two.silhouettes[0].pixels);
}

// A ball excludes triangles and whole groups of them. The curtain of 720 triangles has free,
// crossing and inner triangles, and its number is no multiple of a group.
TEST(CollisionTruth, AgreesWithTheReferenceOnEveryTriangle) {
  const CollisionScene scene = curtain720();
  base::WorkerPool pool(1);
  const Truth truth = exact_truth(scene, pool);
  const collision::HullDistance hull(scene.silhouettes);
  for (std::size_t i = 0; i < 720; ++i) {
    const collision::TriangleTruth exact =
        collision::triangle_truth(hull, scene.objects_world_m[0][i]);
    EXPECT_EQ(truth[0][i].crosses, exact.crosses) << i;
    EXPECT_EQ(truth[0][i].leaves, !exact.inside) << i;
    EXPECT_GE(truth[0][i].deepest_m, exact.deepest_m) << i;
    EXPECT_LE(truth[0][i].deepest_m, exact.deepest_at_most_m + 1e-12) << i;  // 1e-12: rounding
  }
}

// The search for the deepest point ends at 10 um. The parts of these two triangles in the hull are
// 0.08 um deep.
TEST(CollisionTruth, FindsShallowCrossings) {
  const CollisionScene whole = dense();
  CollisionScene scene = whole;
  scene.objects_world_m = {
      {whole.objects_world_m[0].begin() + 479316, whole.objects_world_m[0].begin() + 479318}};
  base::WorkerPool pool(1);
  const Truth truth = exact_truth(scene, pool);
  ASSERT_EQ(truth[0].size(), 2u);
  for (const TriangleTruth& t : truth[0]) {
    EXPECT_TRUE(t.crosses_border());
    EXPECT_GT(t.deepest_m, 1e-8);
    EXPECT_LT(t.deepest_m, 1e-6);
  }
}

// The hull of a ball, and a plate through its center.
TEST(CollisionTruth, ComputesDepthAndVerdictErrors) {
  CollisionScene scene{"ball", {{Vector3d::Zero(), Vector3d::Zero(), 0.05}}, {}, {}, {}, {}};
  for (const Vector3d& eye :
       {Vector3d(2, 0, 0.1), Vector3d(-1, 1.7, 0.1), Vector3d(-1, -1.7, 0.1), Vector3d(0, 0, 2)})
    scene.silhouettes.push_back({{geometry::pinhole_from_fov(400, 400, 0.1),
                                  geometry::look_at(eye, Vector3d::Zero(), Vector3d(1, 2, 3))},
                                 {}});
  for (hull::Silhouette& s : scene.silhouettes)
    s.pixels = hull::true_object_pixels(scene.real_objects, s.camera, hull::PixelRule::touched);
  const double inside_m = 0.02;  // well inside the ball
  scene.objects_world_m = {
      {{Vector3d(-1, -1, 0), Vector3d(1, -1, 0), Vector3d(0, 1.5, 0)},
       {Vector3d(-inside_m, 0, 0), Vector3d(inside_m, 0, 0), Vector3d(0, inside_m, 0)},
       {Vector3d(1, 1, 1), Vector3d(1.1, 1, 1), Vector3d(1, 1.1, 1)}}};
  base::WorkerPool pool(1);
  const auto truth = exact_truth(scene, pool);
  EXPECT_TRUE(truth[0][0].crosses_border() && truth[0][1].crosses && !truth[0][1].leaves &&
              !truth[0][2].crosses && !truth[0][2].near);
  // The plate's deepest point is the ball's center. The hull contains the ball and exceeds it by
  // less than a tenth.
  EXPECT_GT(truth[0][0].deepest_m, 0.0494);
  EXPECT_LT(truth[0][0].deepest_m, 0.055);

  std::vector<collision::ObjectCollision> found(1);
  found[0].triangles = {1, 2};
  auto wrong = wrong_of(found, truth);
  EXPECT_EQ(wrong.missed, 1u);
  EXPECT_EQ(wrong.deepest_missed_m, truth[0][0].deepest_m);
  EXPECT_EQ(wrong.missed_inside, 0u);
  EXPECT_EQ(wrong.invented, 1u);
  found[0].triangles = {0};
  wrong = wrong_of(found, truth);
  EXPECT_EQ(wrong.missed_inside, 1u);
  EXPECT_EQ(wrong.deepest_missed_border_m, 0);
  EXPECT_EQ(wrong.deepest_missed_m, truth[0][1].deepest_m);
  found[0].triangles = {1};
  found[0].undecided = {0};
  wrong = wrong_of(found, truth);
  EXPECT_EQ(wrong.missed, 0u);
  EXPECT_EQ(wrong.invented, 0u);
  EXPECT_EQ(wrong.undecided, 1u);
}

}  // namespace
}  // namespace fivepipe::collision_bench
