// D_rec and N_hull against the exact reference and the analytic hull of a ball.
#include <iostream>
#include <numbers>

#include "common/hull/oracle/reference.h"
#include "tests/support/collision/response.h"

namespace fivepipe::test {
namespace {

constexpr double kSixtyDegrees_rad = std::numbers::pi / 3;

// Returns the intervals of V_rec in the hull, from CP_obj, by the exact reference.
std::vector<hull::Interval> reference_intervals_of(std::span<const hull::Silhouette> silhouettes,
                                                   const collision::Response& response,
                                                   double reach_m) {
  return hull::reference_intervals(silhouettes, {response.cp_object_world_m, response.v_rec_world},
                                   0, reach_m);
}

TEST_F(ResponseTest, RecoveryDistanceEqualsTheExactReference) {
  Random random(21);
  double worst_m = 0, max_error_m = 0;
  for (int i = 0; i < 30; ++i) {
    place(random_above(random, 0.003, 0.012, 0.8));
    ASSERT_TRUE(collision_.colliding());
    const collision::Response response = respond_by_default(),
                              outward =
                                  respond_by_default({.search = collision::HullSearch::outward});
    ASSERT_EQ(response.status, collision::RecoveryStatus::recovered);
    const double reach_m = std::min(0.05, (rp_object_m_ - response.cp_object_world_m).norm());
    const auto intervals = reference_intervals_of(silhouettes_, response, reach_m);
    ASSERT_FALSE(intervals.empty());
    worst_m = std::max({worst_m, std::abs(intervals.back().leave - response.d_rec_m),
                        std::abs(intervals.front().leave - outward.d_rec_m)});
    max_error_m = std::max(max_error_m, response.d_rec_error_m);
    EXPECT_LE(std::abs(intervals.back().leave - response.d_rec_m), response.d_rec_error_m);
    EXPECT_NEAR((response.cp_hull_world_m - response.cp_object_world_m).norm(), response.d_rec_m,
                1e-12);
    EXPECT_LE((response.cp_hull_world_m - response.cp_object_world_m -
               intervals.back().leave * response.v_rec_world)
                  .norm(),
              response.d_rec_error_m + 1e-14);
    EXPECT_NEAR(response.pixel_footprint_m, kFootprint_m,
                kFootprint_m * kRealRadius_m * 1.1);  // cameras at 1 m
    EXPECT_FALSE(
        inside(response.cp_object_world_m + response.clear_distance_m() * response.v_rec_world));
    EXPECT_TRUE(inside(response.cp_object_world_m +
                       (response.d_rec_m - response.d_rec_error_m) * response.v_rec_world));
  }
  std::cout << "D_rec: " << worst_m * 1000
            << " mm largest difference from the exact reference, largest stated error "
            << max_error_m * 1000 << " mm\n";
  EXPECT_LT(worst_m, kScanStep_m);
  EXPECT_LT(max_error_m, kScanStep_m);
}

TEST_F(ResponseTest, SampledSearchIsWithinItsStatedError) {
  Random random(21);
  for (int i = 0; i < 30; ++i) {
    place(random_above(random, 0.003, 0.012, 0.8));
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

TEST_F(ResponseTest, SearchDirectionMattersIfTheHullIsNotConvex) {
  // Two real bars, one above the other: V_rec leads from the lower one through the upper one.
  see({{{-0.03, 0, 0}, {0.03, 0, 0}, 0.005}, {{-0.03, 0, 0.03}, {0.03, 0, 0.03}, 0.005}});
  place(collision::world_triangles(geometry::box_mesh({0.004, 0.004, 0.004}), at(kOrigin)),
        {0, 0, 0.05});
  ASSERT_TRUE(collision_.colliding());
  const collision::ResponseRequest up{rp_object_m_, Eigen::Vector3d(0, 0, 1)};
  const collision::Response from_reference = respond_to(up),
                            outward = respond_to(up, {.search = collision::HullSearch::outward});
  const collision::Response sampled = respond_to(up, {.search = collision::HullSearch::sampled});
  const auto intervals = reference_intervals_of(silhouettes_, outward, 0.05);
  ASSERT_EQ(intervals.size(), 2u);
  EXPECT_NEAR(outward.d_rec_m, intervals[0].leave, kScanStep_m);
  EXPECT_NEAR(from_reference.d_rec_m, intervals[1].leave, kScanStep_m);
  EXPECT_NEAR(sampled.d_rec_m, intervals[1].leave, sampled.d_rec_error_m);
  EXPECT_GT(from_reference.d_rec_m, outward.d_rec_m + 0.02);
}

TEST_F(ResponseTest, RecoveryDistanceEqualsTheAnalyticHullWithinAPixel) {
  std::vector<geometry::Camera> cameras;
  for (const hull::Silhouette& s : silhouettes_) cameras.push_back(s.camera);
  Random random(22);
  for (int i = 0; i < 20; ++i) {
    place(random_above(random, 0.003, 0.012, 0.3));
    const collision::Response response = respond_by_default();
    ASSERT_EQ(response.status, collision::RecoveryStatus::recovered);
    const double analytic_m = exit_m(response, kVirtualRadius_m, [&](const auto& p) {
      return hull::in_analytic_hull(real_, cameras, p);
    });
    // PixelRule::touched extends the silhouette by at most a pixel's diagonal across the line of
    // sight at the ball's near side. Along V_rec this is divided by the cosine to the normal.
    const double cosine = response.v_rec_world.dot(response.cp_hull_world_m.normalized());
    ASSERT_GT(cosine, 0.5);
    const double pixel_m = std::numbers::sqrt2 * kFootprint_m * (1 + kRealRadius_m) / cosine;
    EXPECT_GE(response.d_rec_m + response.d_rec_error_m, analytic_m - kScanStep_m);
    EXPECT_LE(response.d_rec_m, analytic_m + pixel_m + kScanStep_m);
  }
}

TEST_F(ResponseTest, NormalEqualsTheBallsNormal) {
  constexpr int kFine_px = 1280;  // pixels of 0.125 mm
  see({ball(kOrigin, kRealRadius_m)}, kFine_px);
  Random random(24);
  int defined = 0;
  for (int i = 0; i < 20; ++i) {
    place(random_above(random, 0.004, 0.01, 0.3));
    const collision::Response response = respond_by_default({.apex_angle_rad = kSixtyDegrees_rad});
    if (response.four_points.status != collision::NormalStatus::defined) continue;
    ++defined;
    EXPECT_GT(response.four_points.normal_world.dot(response.v_rec_world), 0);
    EXPECT_NEAR(response.four_points.normal_world.norm(), 1, 1e-12);
    // The chord IJ is parallel to the surface at some point between I and J. On the ball, both are
    // at most this far from CP_hull.
    const double curvature_rad =
        response.clear_distance_m() * std::tan(kSixtyDegrees_rad / 2) / kRealRadius_m;
    // 18 viewing directions: the hull's horizontal sections are polygons with exterior angles of 20
    // degrees.
    const Eigen::Vector3d outward = response.cp_hull_world_m.normalized();
    const double polygon_rad = std::numbers::pi / 18 * std::hypot(outward.x(), outward.y());
    EXPECT_LE(std::acos(std::min(1.0, outward.dot(response.four_points.normal_world))),
              response.four_points.error_rad + curvature_rad + polygon_rad);
  }
  EXPECT_GE(defined, 15);
}

TEST_F(ResponseTest, ObjectIsFreeAfterTheMove) {
  Random random(23);
  for (int i = 0; i < 20; ++i) {
    place(random_above(random, 0.006, 0.006, 3.1));
    if (!collision_.colliding()) continue;
    const collision::Response response = respond_by_default();
    if (response.status != collision::RecoveryStatus::recovered) continue;
    place(rp_object_m_ +
          (response.clear_distance_m() + response.residual_m + 1e-9) * response.v_rec_world);
    EXPECT_LE(collision_.points.size(), 2u);
  }
}

TEST_F(ResponseTest, OneNoisyPixelMovesTheObjectByAtMostAPixel) {
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
      // CP_obj may be another sample of the same contact. The distance along V_rec changes by the
      // part of the hull that the pixel removes or adds.
      const double pixel_m = std::numbers::sqrt2 * kFootprint_m * (1 + kRealRadius_m);
      const Eigen::Vector3d moved = after.clear_distance_m() * after.v_rec_world -
                                    before.clear_distance_m() * before.v_rec_world;
      if (after.cp_object_world_m == before.cp_object_world_m) {
        EXPECT_LE(moved.norm(), pixel_m + before.d_rec_error_m);
      }
    }
}

}  // namespace
}  // namespace fivepipe::test
