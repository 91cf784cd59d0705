// The collision response (paper, section 4.3): choice of CP_obj, statuses and invalid requests.
#include <limits>
#include <stdexcept>

#include "tests/support/collision/response.h"
#include "tests/support/not_finite.h"

namespace fivepipe::test {
namespace {

TEST_F(ResponseTest, CpObjectIsTheFarthestPointAndTheFirstOfTies) {
  object_ = {{Eigen::Vector3d(0, 0, 0), {0.01, 0, 0}, {0, 0.01, 0}}};
  collision_.verdict = collision::CollisionVerdict::colliding;
  collision_.points = {{{0, 0, 0.01}, 1}, {{0.02, 0, 0}, 4}, {{0, 0.02, 0}, 5}, {{0, -0.02, 0}, 7}};
  rp_object_m_ = {0, 0, 0};
  const collision::Response response = respond_by_default();
  EXPECT_EQ(response.cp_object_world_m, Eigen::Vector3d(0.02, 0, 0));
}

TEST_F(ResponseTest, EquallyFarPointsResolveToTheDeepest) {
  place({0.004, 0, 0.082});
  ASSERT_TRUE(collision_.colliding());
  const collision::Response deepest = respond_by_default(),
                            first = respond_to({rp_object_m_, std::nullopt});
  // The centre of the contact is on the line through both centres, within the samples' spacing.
  const Eigen::Vector3d line = rp_object_m_.normalized();
  EXPECT_LT((deepest.cp_object_world_m - deepest.cp_object_world_m.dot(line) * line).norm(), 0.003);
  EXPECT_GE(deepest.d_rec_m, first.d_rec_m);
  EXPECT_EQ(deepest.status, collision::RecoveryStatus::recovered);
}

TEST_F(ResponseTest, ComputesOnlyRequestedResults) {
  place({0, 0, 0.082});
  const collision::Response neither = respond_to({rp_object_m_, std::nullopt, {false, false}}),
                            points = respond_to({rp_object_m_, std::nullopt, {true, false}});
  EXPECT_EQ(neither.four_points.status, collision::NormalStatus::not_requested);
  EXPECT_EQ(neither.closed_form.status, collision::NormalStatus::not_requested);
  EXPECT_NE(points.four_points.status, collision::NormalStatus::not_requested);
  EXPECT_EQ(points.closed_form.status, collision::NormalStatus::not_requested);
}

TEST_F(ResponseTest, ShallowContactHasNoCertainNormal) {
  place({0, 0, kRealRadius_m + kVirtualRadius_m - 0.002});
  ASSERT_TRUE(collision_.colliding());
  const collision::Response response = respond_by_default();
  EXPECT_EQ(response.status, collision::RecoveryStatus::recovered);
  EXPECT_NE(response.four_points.status, collision::NormalStatus::defined);
  EXPECT_NE(response.four_points.status, collision::NormalStatus::not_requested);
}

TEST_F(ResponseTest, EdgeThatStartsInTheHullGivesNoNormal) {
  // A real wall beside V_rec contains B or C, because the apex angle is large.
  see({ball(kOrigin, 0.02),
       {{0.03, -0.06, -0.06}, {0.03, -0.06, 0.07}, 0.01},
       {{0.03, 0.06, -0.06}, {0.03, 0.06, 0.07}, 0.01},
       {{0.03, 0, -0.06}, {0.03, 0, 0.07}, 0.01}});
  object_ = collision::world_triangles(geometry::box_mesh({0.01, 0.01, 0.01}), at({0, 0, 0.02}));
  collision_ = moved(kOrigin);
  ASSERT_TRUE(collision_.colliding());
  const collision::Response response =
      respond_to({Eigen::Vector3d(0, 0, 0.06), Eigen::Vector3d(0, 0, 1), {true, true}},
                 {.height_m = 0.04, .apex_angle_rad = 1.3});
  EXPECT_EQ(response.four_points.status, collision::NormalStatus::edge_starts_inside);
  EXPECT_EQ(response.four_points.normal_world, Eigen::Vector3d::Zero());
}

TEST_F(ResponseTest, ReferenceInTheHullHasNoResponseWithoutADirection) {
  place({0, 0, 0.03});  // the centre is 2 cm deep in the hull
  EXPECT_EQ(respond_by_default().status, collision::RecoveryStatus::reference_inside);
  // With a given direction the search does not start at RP_obj.
  const collision::Response upwards =
      respond_to({rp_object_m_, Eigen::Vector3d(0, 0, 1)}, {.height_m = 0.1});
  EXPECT_TRUE(upwards.has_exit());
  EXPECT_GT(upwards.d_rec_m, 0);
}

TEST_F(ResponseTest, ReferenceAtTheCollisionPointIsReferenceInside) {
  object_ = {{Eigen::Vector3d(0, 0, 0), {0.01, 0, 0}, {0, 0.01, 0}}};
  collision_.points = {{{0, 0, 0}, 0}};
  const collision::Response response = respond_to({kOrigin, std::nullopt});
  EXPECT_EQ(response.status, collision::RecoveryStatus::reference_inside);
  EXPECT_EQ(response.cp_object_world_m, kOrigin);
}

TEST_F(ResponseTest, ObjectInsideTheHullReferenceInTheHullHasNoResponseWithoutADirection) {
  object_ = collision::world_triangles(geometry::sphere_mesh(0.01, 1), at(kOrigin));
  collision_ = moved(kOrigin);
  EXPECT_EQ(respond_to({kOrigin, std::nullopt}).status,
            collision::RecoveryStatus::reference_inside);
}

TEST_F(ResponseTest, LengthOfTheGivenDirectionDoesNotMatter) {
  place({0, 0, 0.083});
  const collision::Response unit = respond_to({rp_object_m_, Eigen::Vector3d(0, 0.6, 0.8)});
  ASSERT_TRUE(unit.has_exit());
  EXPECT_NEAR((unit.v_rec_world - Eigen::Vector3d(0, 0.6, 0.8)).norm(), 0, 1e-15);
  for (const double length : {1e-200, 1e-3, 1e200}) {
    const collision::Response scaled =
        respond_to({rp_object_m_, length * Eigen::Vector3d(0, 0.6, 0.8)});
    EXPECT_EQ(scaled.status, unit.status);
    EXPECT_NEAR(scaled.d_rec_m, unit.d_rec_m, unit.d_rec_error_m);
  }
}

TEST_F(ResponseTest, ZeroOrNonFiniteDirectionIsUndefined) {
  place({0, 0, 0.083});
  const collision::Response response = respond_to({rp_object_m_, kOrigin});
  EXPECT_EQ(response.status, collision::RecoveryStatus::direction_undefined);
  EXPECT_EQ(response.v_rec_world, kOrigin);
  const Eigen::Vector3d nan(0, std::numeric_limits<double>::quiet_NaN(), 0);
  for (const Eigen::Vector3d& direction : {nan, Eigen::Vector3d(0, 0, kInfinity)}) {
    const collision::Response undefined = respond_to({rp_object_m_, direction});
    EXPECT_EQ(undefined.status, collision::RecoveryStatus::direction_undefined);
    EXPECT_EQ(undefined.v_rec_world, kOrigin);
  }
  EXPECT_THROW(respond_to({nan, std::nullopt}), std::invalid_argument);
}

TEST_F(ResponseTest, DirectionPointingInwardHasNoExitWithinReach) {
  place({0, 0, 0.083});
  EXPECT_EQ(respond_to({rp_object_m_, Eigen::Vector3d(0, 0, -1)}).status,
            collision::RecoveryStatus::no_exit_within_reach);
  // A longer reach leads through to the other side.
  const collision::Response through =
      respond_to({rp_object_m_, Eigen::Vector3d(0, 0, -1)}, {.height_m = 0.15});
  EXPECT_GT(through.d_rec_m, 0.08);
}

TEST_F(ResponseTest, TangentDirectionExitsOnTheFarSideOfTheContact) {
  place({0, 0, 0.085});
  const collision::Response response = respond_to({rp_object_m_, Eigen::Vector3d(1, 0, 0)});
  // The contact is a cap of the real ball, whose chord is shorter than this.
  EXPECT_TRUE(response.has_exit());
  EXPECT_LT(response.d_rec_m, 0.05);
  EXPECT_GT(response.d_rec_m, 0);
}

TEST_F(ResponseTest, SecondContactIsStillCollidingWithAResidual) {
  // A virtual box between two real balls, deeper in one of them: after it leaves the deeper one, it
  // still collides with the other.
  see({ball({-0.045, 0, 0}, 0.02), ball({0.045, 0, 0}, 0.02)});
  object_ = collision::world_triangles(geometry::box_mesh({0.06, 0.01, 0.01}), at({0.004, 0, 0}));
  collision_ = moved(kOrigin);
  ASSERT_TRUE(collision_.colliding());
  const collision::Response response = respond_to({Eigen::Vector3d(0.004, 0, 0), std::nullopt});
  EXPECT_EQ(response.status, collision::RecoveryStatus::still_colliding);
  EXPECT_GT(response.residual_m, response.d_rec_error_m + response.pixel_footprint_m);
}

TEST_F(ResponseTest, PenetrationDeeperThanTheTriangleHasNoExitWithinReach) {
  place({0, 0, 0.07});
  const collision::Response response = respond_by_default({.height_m = 0.005});
  EXPECT_EQ(response.status, collision::RecoveryStatus::no_exit_within_reach);
}

TEST_F(ResponseTest, RejectsInvalidRequests) {
  place({0, 0, 0.083});
  EXPECT_THROW(respond_by_default({.height_m = 0}), std::invalid_argument);
  EXPECT_THROW(respond_by_default({.height_m = std::numeric_limits<double>::quiet_NaN()}),
               std::invalid_argument);
  EXPECT_THROW(respond_by_default({.height_m = kInfinity}), std::invalid_argument);
  EXPECT_THROW(respond_by_default({.apex_angle_rad = 3.2}), std::invalid_argument);
  EXPECT_THROW(respond_by_default({.apex_angle_rad = 0}), std::invalid_argument);
  EXPECT_THROW(respond_by_default({.apex_angle_rad = kNaN}), std::invalid_argument);
  EXPECT_THROW(respond_by_default({.window_px = 0}), std::invalid_argument);
  EXPECT_THROW(collision::respond(query(), collision_, {rp_object_m_, std::nullopt}, {}),
               std::invalid_argument);
  EXPECT_THROW(respond_to({rp_object_m_, std::nullopt, {}, -1e-3}), std::invalid_argument);
  EXPECT_THROW(respond_to({rp_object_m_, std::nullopt, {}, kNaN}), std::invalid_argument);
  collision_.points.front().p_world_m.y() = kNaN;
  EXPECT_THROW(respond_by_default(), std::invalid_argument);
}

TEST_F(ResponseTest, SameInputSameBits) {
  place({0.01, 0.003, 0.083});
  const collision::Response a = respond_by_default(), b = respond_by_default();
  EXPECT_EQ(a.cp_object_world_m, b.cp_object_world_m);
  EXPECT_EQ(a.d_rec_m, b.d_rec_m);
  EXPECT_EQ(a.four_points.normal_world, b.four_points.normal_world);
  EXPECT_EQ(a.closed_form.normal_world, b.closed_form.normal_world);
  EXPECT_EQ(a.residual_m, b.residual_m);
}

}  // namespace
}  // namespace fivepipe::test
