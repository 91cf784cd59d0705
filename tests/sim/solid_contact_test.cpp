// The touch of a particle with boxes, balls and meshes that move within a step.
#include "sim_node/objects/solid_contact.h"

#include <gtest/gtest.h>

#include "tests/support/hull/scenes.h"
#include "tests/support/not_finite.h"

namespace fivepipe::sim {
namespace {

using Eigen::Vector3d;

constexpr double kRadius_m = 0.003;
const Vector3d kHalf_m(0.3, 0.2, 0.1);

PathInStep path(const Vector3d& from_m, const Vector3d& to_m) { return {from_m, to_m, kRadius_m}; }

TEST(SolidContact, AParticleAboveABoxIsHeldByItsTop) {
  const auto touch = box_contact(kHalf_m, path({0.1, 0, 0.12}, {0.1, 0, 0.101}));
  ASSERT_TRUE(touch);
  EXPECT_EQ(touch->normal, Vector3d(0, 0, 1));
  EXPECT_NEAR(touch->distance_m, 0.001, 1e-15);
  EXPECT_FALSE(box_contact(kHalf_m, path({0.1, 0, 0.12}, {0.1, 0, 0.104})));
}

// It would end 30 cm behind the box.
TEST(SolidContact, AFastParticleDoesNotPassThroughABox) {
  const auto touch = box_contact(kHalf_m, path({0.1, 0, 0.4}, {0.1, 0, -0.4}));
  ASSERT_TRUE(touch);
  EXPECT_EQ(touch->normal, Vector3d(0, 0, 1));
  EXPECT_NEAR(touch->distance_m, -0.5, 1e-15);
  EXPECT_FALSE(box_contact(kHalf_m, path({0.5, 0, 0.4}, {0.5, 0, -0.4})));
}

// At its start the path is farther from the +x face (20 cm) than from the top (4 cm), but it
// crosses the plane of the top last.
TEST(SolidContact, APathEntersABoxThroughTheFaceThatItCrossesLast) {
  const auto touch = box_contact(kHalf_m, path({0.5, 0, 0.14}, {0.1, 0, 0.09}));
  ASSERT_TRUE(touch);
  EXPECT_EQ(touch->normal, Vector3d(0, 0, 1));
  EXPECT_FALSE(box_contact(kHalf_m, path({0.35, 0, 0.06}, {0.25, 0, 0.16})))
      << "it passes the edge";
}

TEST(SolidContact, AParticleInABoxLeavesByTheNearestFace) {
  const auto touch = box_contact(kHalf_m, path({-0.28, 0, 0}, {-0.29, 0, 0}));
  ASSERT_TRUE(touch);
  EXPECT_EQ(touch->normal, Vector3d(-1, 0, 0));
  EXPECT_NEAR(touch->distance_m, -0.01, 1e-15);
}

// After the response to a touch, the particle touches the same face again if it stays.
TEST(SolidContact, AParticleThatRestsOnAFaceKeepsIt) {
  test::Random random(1);
  for (int i = 0; i < 1000; ++i) {
    const Vector3d from_m{test::uniform(random, -0.3, 0.3), test::uniform(random, -0.2, 0.2),
                          kHalf_m.z() + kRadius_m};
    const auto touch = box_contact(kHalf_m, path(from_m, from_m - Vector3d(0, 0, 1e-4)));
    ASSERT_TRUE(touch) << from_m.transpose();
    EXPECT_EQ(touch->normal, Vector3d(0, 0, 1)) << from_m.transpose();
  }
}

// It begins where a face, or the ball, has stopped it, within rounding, and ends beyond the centre.
TEST(SolidContact, APathFromTheSurfaceLeavesOnItsSideHoweverDeepItEnds) {
  for (const double rounding_m : {-1e-16, 0.0, 1e-16}) {
    const auto box =
        box_contact(kHalf_m, path({0.1, 0, kHalf_m.z() + kRadius_m + rounding_m}, {0.1, 0, -0.08}));
    ASSERT_TRUE(box);
    EXPECT_EQ(box->normal, Vector3d(0, 0, 1));
    EXPECT_NEAR(box->distance_m, -0.18, 1e-12);
    const auto ball = ball_contact(0.1, path({0, 0, 0.1 + kRadius_m + rounding_m}, {0, 0, -0.08}));
    ASSERT_TRUE(ball);
    EXPECT_EQ(ball->normal, Vector3d(0, 0, 1));
    EXPECT_NEAR(ball->distance_m, -0.18, 1e-12);
  }
}

TEST(SolidContact, NoPathEndsInABoxThatItEntered) {
  test::Random random(2);
  int touches = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vector3d from_m = test::random_in_ball(random, 0.6),
                   to_m = from_m + test::random_in_ball(random, 0.2);
    if (((from_m.cwiseAbs() - kHalf_m).array() < kRadius_m).all()) continue;
    const auto touch = box_contact(kHalf_m, path(from_m, to_m));
    const bool ends_in = ((to_m.cwiseAbs() - kHalf_m).array() < kRadius_m).all();
    if (ends_in) {
      ASSERT_TRUE(touch);
    }
    if (!touch || touch->distance_m >= kRadius_m) continue;
    ++touches;
    const Vector3d end_m = to_m + (kRadius_m - touch->distance_m) * touch->normal;
    EXPECT_GE((end_m.cwiseAbs() - kHalf_m).maxCoeff(), kRadius_m - 1e-12);
  }
  EXPECT_GT(touches, 500);
}

TEST(SolidContact, ABallHoldsAParticleAtItsRadius) {
  const auto rest = ball_contact(0.1, path({0, 0, 0.103}, {0, 0, 0.1029}));
  ASSERT_TRUE(rest);
  EXPECT_NEAR(rest->distance_m, 0.0029, 1e-12);
  const auto fast = ball_contact(0.1, path({0.02, 0, 0.5}, {0.02, 0, -0.5}));
  ASSERT_TRUE(fast);
  EXPECT_NEAR(fast->normal.x(), 0.02 / 0.103, 1e-12);
  EXPECT_GT(fast->normal.z(), 0.9);
  EXPECT_FALSE(ball_contact(0.1, path({0.104, 0, 0.5}, {0.104, 0, -0.5})));
  const auto center = ball_contact(0.1, path({0, 0, 0}, {0, 0, 0}));
  ASSERT_TRUE(center);
  EXPECT_EQ(center->normal, Vector3d(0, 0, 1));
  EXPECT_EQ(center->distance_m, -0.1);
}

geometry::Mesh sheet() { return geometry::curtain_mesh(1, 1, 8, 8, 0, 0); }  // in y = 0

TEST(SolidContact, ASheetHoldsParticlesOnBothOfItsSides) {
  const collision::Bvh tree(sheet());
  const double z_m = geometry::bounds_m(tree.mesh()).center().z();
  for (const double side : {-1.0, 1.0}) {
    const auto rest =
        mesh_contact(tree, {}, 0, path({0.03, side * 0.003, z_m}, {0.03, side * 0.0029, z_m}));
    ASSERT_TRUE(rest);
    EXPECT_LT((rest->plane.normal - Vector3d(0, side, 0)).norm(), 1e-9);
    const auto through =
        mesh_contact(tree, {}, 0, path({0.03, side * 0.01, z_m}, {0.03, -side * 0.02, z_m}));
    ASSERT_TRUE(through);
    EXPECT_LT((through->plane.normal - Vector3d(0, side, 0)).norm(), 1e-9);
    EXPECT_NEAR(through->plane.distance_m, -0.02, 1e-9);
  }
  EXPECT_FALSE(mesh_contact(tree, {}, 0, path({0.03, 0.02, z_m}, {0.03, 0.01, z_m})));
  // Beside the sheet's edge at x = 0.5 m.
  EXPECT_FALSE(mesh_contact(tree, {}, 0, path({0.52, 0.01, z_m}, {0.52, -0.01, z_m})));
}

// A sheet that passes over a particle at rest takes it along, on the side on which it was.
TEST(SolidContact, ASheetThatMovesTakesAParticleAlong) {
  geometry::Mesh now = sheet();
  const std::vector<Vector3d> before_m = now.vertices_m;
  for (Vector3d& v : now.vertices_m) v.y() += 0.02;
  const double z_m = geometry::bounds_m(now).center().z();
  const auto touch =
      mesh_contact(collision::Bvh(now), before_m, 0.02, path({0, 0.01, z_m}, {0, 0.01, z_m}));
  ASSERT_TRUE(touch);
  EXPECT_LT((touch->plane.normal - Vector3d(0, 1, 0)).norm(), 1e-9);
  EXPECT_NEAR(touch->plane.distance_m, -0.01, 1e-9);
  EXPECT_NEAR(touch->weights.sum(), 1, 1e-12);
}

// A path that rounds an edge of a closed mesh crosses no surface, although it ends behind the plane
// of the nearest one.
TEST(SolidContact, APathAroundAnEdgeIsFree) {
  const collision::Bvh tree(geometry::box_mesh({0.2, 0.2, 0.2}));
  const auto free = mesh_contact(tree, {}, 0, path({0.099, 0.106, 0}, {0.106, 0.099, 0}));
  EXPECT_FALSE(free && free->plane.distance_m < kRadius_m);
}

// As for a box: the response ends outside, and a path that enters is stopped.
TEST(SolidContact, NoPathEndsInAMeshThatItEntered) {
  const collision::Bvh tree(geometry::box_mesh(2 * kHalf_m));
  test::Random random(4);
  int touches = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vector3d from_m = test::random_in_ball(random, 0.6),
                   to_m = from_m + test::random_in_ball(random, 0.2);
    if (((from_m.cwiseAbs() - kHalf_m).array() < kRadius_m).all()) continue;
    const auto touch = mesh_contact(tree, {}, 0, path(from_m, to_m));
    if (((to_m.cwiseAbs() - kHalf_m).array() < 0).all()) {
      ASSERT_TRUE(touch);
    }
    if (!touch || touch->plane.distance_m >= kRadius_m) continue;
    ++touches;
    const Vector3d end_m = to_m + (kRadius_m - touch->plane.distance_m) * touch->plane.normal;
    EXPECT_GE((end_m.cwiseAbs() - kHalf_m).maxCoeff(), -1e-9) << from_m.transpose();
    EXPECT_NEAR(touch->weights.sum(), 1, 1e-9);
  }
  EXPECT_GT(touches, 500);
}

TEST(SolidContact, NaNTouchesNothing) {
  const collision::Bvh tree(sheet());
  for (const double bad : {test::kNaN, test::kInfinity, -test::kInfinity})
    for (int axis = 0; axis < 3; ++axis) {
      Vector3d p_m = Vector3d::Zero();
      p_m[axis] = bad;
      for (const PathInStep& bad_path : {path(p_m, p_m), path(Vector3d::Zero(), p_m)}) {
        EXPECT_FALSE(box_contact(kHalf_m, bad_path));
        EXPECT_FALSE(ball_contact(0.1, bad_path));
        EXPECT_FALSE(mesh_contact(tree, {}, 0, bad_path));
      }
    }
}

}  // namespace
}  // namespace fivepipe::sim
