// Moving an object out of the hull (paper, section 4.3).
#include <iostream>
#include <limits>
#include <stdexcept>

#include "common/hull/oracle/reference.h"
#include "tests/support/collision_response.h"

namespace fivepipe::test {
namespace {

constexpr double kSixtyDegrees_rad = std::numbers::pi / 3;

TEST_F(ResponseTest, CpObjectIsTheFarthestPointTiesTakeTheFirst) {
  object_ = {{Eigen::Vector3d(0, 0, 0), {0.01, 0, 0}, {0, 0.01, 0}}};
  collision_.verdict = collision::CollisionVerdict::colliding;
  collision_.points = {{{0, 0, 0.01}, 1}, {{0.02, 0, 0}, 4}, {{0, 0.02, 0}, 5}, {{0, -0.02, 0}, 7}};
  rp_object_m_ = {0, 0, 0};
  const collision::Response response = respond_by_default();
  EXPECT_EQ(response.cp_object_triangle, 4u);
  EXPECT_EQ(response.cp_object_world_m, Eigen::Vector3d(0.02, 0, 0));
}

TEST_F(ResponseTest, EquallyFarPointsResolveToTheDeepest) {
  place({0.004, 0, 0.082});
  ASSERT_TRUE(collision_.colliding());
  const collision::Response deepest = respond_by_default(),
                            first = respond_to({rp_object_m_, std::nullopt});
  // The middle of the contact lies on the line of the centres, within the spacing of the samples.
  const Eigen::Vector3d line = rp_object_m_.normalized();
  EXPECT_LT((deepest.cp_object_world_m - deepest.cp_object_world_m.dot(line) * line).norm(), 0.003);
  EXPECT_GE(deepest.d_rec_m, first.d_rec_m);
  EXPECT_EQ(deepest.status, collision::RecoveryStatus::recovered);
}

// V_rec as the exact reference has it: where it is in the hull, from CP_obj on.
std::vector<hull::Interval> reference_way(std::span<const hull::Silhouette> silhouettes,
                                          const collision::Response& response, double reach_m) {
  return hull::reference_intervals(silhouettes, {response.cp_object_world_m, response.v_rec_world},
                                   0, reach_m);
}

TEST_F(ResponseTest, RecoveryDistanceIsThatOfTheExactReference) {
  Random random(21);
  double worst_m = 0, max_error_m = 0;
  for (int i = 0; i < 30; ++i) {
    place(above(kRealRadius_m + kVirtualRadius_m - uniform(random, 0.003, 0.012),
                uniform(random, 0, 0.8), uniform(random, 0, 6.28)));
    ASSERT_TRUE(collision_.colliding());
    const collision::Response response = respond_by_default(),
                              outward =
                                  respond_by_default({.search = collision::HullSearch::outward});
    ASSERT_EQ(response.status, collision::RecoveryStatus::recovered);
    const double reach_m = std::min(0.05, (rp_object_m_ - response.cp_object_world_m).norm());
    const auto way = reference_way(silhouettes_, response, reach_m);
    ASSERT_FALSE(way.empty());
    worst_m = std::max({worst_m, std::abs(way.back().leave - response.d_rec_m),
                        std::abs(way.front().leave - outward.d_rec_m)});
    max_error_m = std::max(max_error_m, response.d_rec_error_m);
    EXPECT_LE(std::abs(way.back().leave - response.d_rec_m), response.d_rec_error_m);
    EXPECT_NEAR((response.cp_hull_world_m - response.cp_object_world_m).norm(), response.d_rec_m,
                1e-12);
    EXPECT_LE((response.cp_hull_world_m - response.cp_object_world_m -
               way.back().leave * response.v_rec_world)
                  .norm(),
              response.d_rec_error_m + 1e-14);
    EXPECT_NEAR(response.pixel_footprint_m, kFootprint_m,
                kFootprint_m * kRealRadius_m * 1.1);  // cameras at 1 m
    EXPECT_FALSE(
        inside(response.cp_object_world_m + response.clear_distance_m() * response.v_rec_world));
    EXPECT_TRUE(inside(response.cp_object_world_m +
                       (response.d_rec_m - response.d_rec_error_m) * response.v_rec_world));
  }
  std::cout << "D_rec: " << worst_m * 1000 << " mm from the exact reference at most, stated error "
            << max_error_m * 1000 << " mm at most\n";
  EXPECT_LT(worst_m, kScanStep_m);
  EXPECT_LT(max_error_m, kScanStep_m);
}

TEST_F(ResponseTest, SampledSearchIsWithinItsStatedError) {
  Random random(21);
  for (int i = 0; i < 30; ++i) {
    place(above(kRealRadius_m + kVirtualRadius_m - uniform(random, 0.003, 0.012),
                uniform(random, 0, 0.8), uniform(random, 0, 6.28)));
    ASSERT_TRUE(collision_.colliding());
    const collision::Response response =
        respond_by_default({.search = collision::HullSearch::sampled, .window_px = 200});
    ASSERT_EQ(response.status, collision::RecoveryStatus::recovered);
    const double reach_m = std::min(0.05, (rp_object_m_ - response.cp_object_world_m).norm());
    EXPECT_DOUBLE_EQ(response.d_rec_error_m, reach_m / 200);
    const double exact_m = exit_m(response, reach_m, [&](const auto& p) { return inside(p); });
    EXPECT_GE(exact_m, response.d_rec_m - kScanStep_m);
    EXPECT_LE(exact_m, response.d_rec_m + response.d_rec_error_m + kScanStep_m);
    EXPECT_TRUE(inside(response.cp_hull_world_m));
    EXPECT_FALSE(
        inside(response.cp_object_world_m + response.clear_distance_m() * response.v_rec_world));
  }
}

TEST_F(ResponseTest, SearchesFromTheReferenceAndOutwardDifferWhereTheHullIsNotConvex) {
  // Two real bars over each other: out of the lower one, the way leads through the upper one.
  see({{{-0.03, 0, 0}, {0.03, 0, 0}, 0.005}, {{-0.03, 0, 0.03}, {0.03, 0, 0.03}, 0.005}});
  place(collision::world_triangles(geometry::box_mesh({0.004, 0.004, 0.004}), at(kOrigin)),
        {0, 0, 0.05});
  ASSERT_TRUE(collision_.colliding());
  const collision::ResponseRequest up{rp_object_m_, Eigen::Vector3d(0, 0, 1)};
  const collision::Response from_reference = respond_to(up),
                            outward = respond_to(up, {.search = collision::HullSearch::outward});
  const collision::Response sampled = respond_to(up, {.search = collision::HullSearch::sampled});
  const auto way = reference_way(silhouettes_, outward, 0.05);
  ASSERT_EQ(way.size(), 2u);
  EXPECT_NEAR(outward.d_rec_m, way[0].leave, kScanStep_m);
  EXPECT_NEAR(from_reference.d_rec_m, way[1].leave, kScanStep_m);
  EXPECT_NEAR(sampled.d_rec_m, way[1].leave, sampled.d_rec_error_m);
  EXPECT_GT(from_reference.d_rec_m, outward.d_rec_m + 0.02);
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

TEST_F(ResponseTest, RecoveryDistanceIsThatOfTheTrueSilhouettesWithinAPixel) {
  std::vector<geometry::Camera> cameras;
  for (const hull::Silhouette& s : silhouettes_) cameras.push_back(s.camera);
  Random random(22);
  for (int i = 0; i < 20; ++i) {
    place(above(kRealRadius_m + kVirtualRadius_m - uniform(random, 0.003, 0.012),
                uniform(random, 0, 0.3), uniform(random, 0, 6.28)));
    const collision::Response response = respond_by_default();
    ASSERT_EQ(response.status, collision::RecoveryStatus::recovered);
    const double analytic_m = exit_m(response, kVirtualRadius_m, [&](const auto& p) {
      return hull::in_analytic_hull(real_, cameras, p);
    });
    // Touched maps reach beyond the silhouette by a pixel's diagonal at most, seen across the line
    // of sight at the ball's near side; along V_rec by that over the cosine to the surface's
    // normal.
    const double cosine = response.v_rec_world.dot(response.cp_hull_world_m.normalized());
    ASSERT_GT(cosine, 0.5);
    const double pixel_m = std::numbers::sqrt2 * kFootprint_m * (1 + kRealRadius_m) / cosine;
    EXPECT_GE(response.d_rec_m + response.d_rec_error_m, analytic_m - kScanStep_m);
    EXPECT_LE(response.d_rec_m, analytic_m + pixel_m + kScanStep_m);
  }
}

TEST_F(ResponseTest, AfterTheMoveNothingOfTheObjectCollides) {
  Random random(23);
  for (int i = 0; i < 20; ++i) {
    place(above(kRealRadius_m + kVirtualRadius_m - 0.006, uniform(random, 0, 3.1),
                uniform(random, 0, 6.28)));
    if (!collision_.colliding()) continue;
    const collision::Response response = respond_by_default();
    if (response.status != collision::RecoveryStatus::recovered) continue;
    place(rp_object_m_ +
          (response.clear_distance_m() + response.residual_m + 1e-9) * response.v_rec_world);
    EXPECT_LE(collision_.points.size(), 2u);
  }
}

TEST_F(ResponseTest, NormalIsThatOfTheBall) {
  constexpr int kFine_px = 1280;  // pixels of 0.125 mm
  see({ball(kOrigin, kRealRadius_m)}, kFine_px);
  Random random(24);
  int defined = 0;
  for (int i = 0; i < 20; ++i) {
    place(above(kRealRadius_m + kVirtualRadius_m - uniform(random, 0.004, 0.01),
                uniform(random, 0, 0.3), uniform(random, 0, 6.28)));
    const collision::Response response = respond_by_default({.apex_angle_rad = kSixtyDegrees_rad});
    if (response.four_points.status != collision::NormalStatus::defined) continue;
    ++defined;
    EXPECT_GT(response.four_points.normal_world.dot(response.v_rec_world), 0);
    EXPECT_NEAR(response.four_points.normal_world.norm(), 1, 1e-12);
    // The chord IJ is parallel to the surface somewhere between I and J, each at most this far from
    // CP_hull on the ball.
    const double curvature_rad =
        response.clear_distance_m() * std::tan(kSixtyDegrees_rad / 2) / kRealRadius_m;
    // 18 directions of sight: the hull's horizontal sections are polygons whose sides turn by 20
    // degrees.
    const Eigen::Vector3d outward = response.cp_hull_world_m.normalized();
    const double polygon_rad = std::numbers::pi / 18 * std::hypot(outward.x(), outward.y());
    EXPECT_LE(std::acos(std::min(1.0, outward.dot(response.four_points.normal_world))),
              response.four_points.error_rad + curvature_rad + polygon_rad);
  }
  EXPECT_GE(defined, 15);
}

TEST_F(ResponseTest, ShallowContactReportsTooUncertain) {
  place({0, 0, kRealRadius_m + kVirtualRadius_m - 0.002});
  ASSERT_TRUE(collision_.colliding());
  const collision::Response response = respond_by_default();
  EXPECT_EQ(response.status, collision::RecoveryStatus::recovered);
  EXPECT_NE(response.four_points.status, collision::NormalStatus::defined);
  EXPECT_NE(response.four_points.status, collision::NormalStatus::not_requested);
}

TEST_F(ResponseTest, EdgeThatStartsInTheHullLeavesTheNormalUndefined) {
  // A real wall beside the way out: B or C, wide apart, ends in it.
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

TEST_F(ResponseTest, ReportsReferenceInside) {
  place({0, 0, 0.03});  // its centre is 2 cm deep
  EXPECT_EQ(respond_by_default().status, collision::RecoveryStatus::reference_inside);
  // Given a direction, there is something to search from.
  const collision::Response upwards =
      respond_to({rp_object_m_, Eigen::Vector3d(0, 0, 1)}, {.height_m = 0.1});
  EXPECT_TRUE(upwards.has_exit());
  EXPECT_GT(upwards.d_rec_m, 0);
}

TEST_F(ResponseTest, ReferenceAtTheCollisionPointIsInTheHull) {
  object_ = {{Eigen::Vector3d(0, 0, 0), {0.01, 0, 0}, {0, 0.01, 0}}};
  collision_.points = {{{0, 0, 0}, 0}};
  const collision::Response response = respond_to({kOrigin, std::nullopt});
  EXPECT_EQ(response.status, collision::RecoveryStatus::reference_inside);
  EXPECT_EQ(response.cp_object_world_m, kOrigin);
}

TEST_F(ResponseTest, ObjectInsideTheHullReportsReferenceInside) {
  object_ = collision::world_triangles(geometry::sphere_mesh(0.01, 1), at(kOrigin));
  collision_ = moved(kOrigin);
  EXPECT_EQ(respond_to({kOrigin, std::nullopt}).status,
            collision::RecoveryStatus::reference_inside);
}

TEST_F(ResponseTest, GivenDirectionOfAnyLengthIsTheSame) {
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

TEST_F(ResponseTest, DirectionThatIsZeroOrNotFiniteIsUndefinedAndAReferenceThatIsNotFiniteRefused) {
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
  // Long enough, it leads through to the other side.
  const collision::Response through =
      respond_to({rp_object_m_, Eigen::Vector3d(0, 0, -1)}, {.height_m = 0.15});
  EXPECT_GT(through.d_rec_m, 0.08);
}

TEST_F(ResponseTest, TangentDirectionFindsTheFarSideOfTheContact) {
  place({0, 0, 0.085});
  const collision::Response response = respond_to({rp_object_m_, Eigen::Vector3d(1, 0, 0)});
  // The cap is cut by the virtual ball where both surfaces meet: its chord is at most this long.
  EXPECT_TRUE(response.has_exit());
  EXPECT_LT(response.d_rec_m, 0.05);
  EXPECT_GT(response.d_rec_m, 0);
}

TEST_F(ResponseTest, ContactAtTwoPlacesIsStillCollidingWithTheResidual) {
  // Two real balls, a virtual one wedged deeper into one than into the other: moved out of the
  // deeper, it stays in the other.
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

TEST_F(ResponseTest, OnePixelOfNoiseMovesTheResultByNoMoreThanPixels) {
  place({0, 0, 0.083});
  const collision::Response before = respond_by_default();
  const std::vector<hull::Silhouette> clean = silhouettes_;
  for (std::size_t noisy = 0; noisy < clean.size(); ++noisy)
    for (const bool object : {true, false}) {
      auto silhouettes = clean;
      const hull::PixelRect bounds = silhouettes[noisy].pixels.bounds();
      silhouettes[noisy].pixels.set(kImage_px / 2, object ? bounds.v0_px - 1 : bounds.v0_px,
                                    object);
      see(silhouettes);
      place(rp_object_m_);
      ASSERT_TRUE(collision_.colliding());
      const collision::Response after = respond_by_default();
      // CP_obj may be another sample of the same contact, its distance along V_rec differs by what
      // the pixel takes away or adds.
      const double pixel_m = std::numbers::sqrt2 * kFootprint_m * (1 + kRealRadius_m);
      const Eigen::Vector3d moved = after.clear_distance_m() * after.v_rec_world -
                                    before.clear_distance_m() * before.v_rec_world;
      if (after.cp_object_world_m == before.cp_object_world_m) {
        EXPECT_LE(moved.norm(), pixel_m + before.d_rec_error_m);
      }
    }
}

TEST_F(ResponseTest, RejectsInvalidRequests) {
  place({0, 0, 0.083});
  EXPECT_THROW(respond_by_default({.height_m = 0}), std::invalid_argument);
  EXPECT_THROW(respond_by_default({.height_m = std::numeric_limits<double>::quiet_NaN()}),
               std::invalid_argument);
  EXPECT_THROW(respond_by_default({.apex_angle_rad = 3.2}), std::invalid_argument);
  EXPECT_THROW(respond_by_default({.window_px = 0}), std::invalid_argument);
  EXPECT_THROW(collision::respond(query(), collision_, {rp_object_m_, std::nullopt}, {}),
               std::invalid_argument);
  EXPECT_THROW(respond_to({rp_object_m_, std::nullopt, {}, -1e-3}), std::invalid_argument);
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
