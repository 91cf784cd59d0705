// CP_hull and N_hull on the border of sub-pixel silhouettes, against the analytic hull of balls.
#include "common/collision/response/coverage_border.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "common/collision/response/hull_normal.h"
#include "tests/support/hull/queries.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

constexpr double kRadius_m = 0.05;

double quantile_of(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values.at(std::size_t(q * double(values.size() - 1)));
}

// A ball that random cameras see as discs of radius_px.
struct Ball {
  std::vector<hull::Capsule> real{{Vector3d::Zero(), Vector3d::Zero(), kRadius_m}};
  std::vector<geometry::Camera> cameras;
  std::vector<hull::Silhouette> silhouettes;
  std::vector<hull::CoverageSilhouette> covered;
  Ball(Random& random, double radius_px) {
    const int size_px = int(3.4 * radius_px);
    for (int i = 0; i < 6; ++i) {
      const double distance_m = uniform(random, 1.2, 1.8),
                   f_px = radius_px * distance_m / kRadius_m, off_px = uniform(random, -0.5, 0.5);
      cameras.push_back(
          {{size_px, size_px, f_px, f_px, 0.5 * size_px + off_px, 0.5 * size_px - 0.7 * off_px},
           random_look_at(random, distance_m * random_direction(random), kOrigin)});
      covered.push_back({cameras.back(), hull::true_coverage(real, cameras.back())});
    }
    silhouettes = silhouettes_of(real, cameras, hull::PixelRule::touched);
  }
  // Distance along the ray at which the convex analytic hull ends, and the limiting camera.
  std::pair<double, std::size_t> exit(const Vector3d& p, const Vector3d& direction) const {
    double in_m = 0, out_m = 0.2;
    while (out_m - in_m > 1e-12)
      (hull::in_analytic_hull(real, cameras, p + 0.5 * (in_m + out_m) * direction) ? in_m : out_m) =
          0.5 * (in_m + out_m);
    for (std::size_t i = 0; i < cameras.size(); ++i)
      if (!hull::in_analytic_hull(real, {&cameras[i], 1}, p + out_m * direction)) return {out_m, i};
    return {out_m, 0};
  }
  Vector3d cone_normal(std::size_t camera, const Vector3d& p) const {
    const Vector3d eye = geometry::camera_center_world_m(cameras[camera]),
                   sight = (p - eye).normalized(),
                   away = p - (p.dot(eye) / eye.squaredNorm()) * eye;
    return (away - away.dot(sight) * sight).normalized();
  }
};

// A response as respond() makes it, of a collision point p of an object that leaves along v_rec.
collision::Response response_of(const Queries& hull, const Vector3d& p, const Vector3d& v_rec) {
  const auto exit = collision::exit_from_base(hull.query, p, v_rec, 0.2);
  EXPECT_TRUE(exit);
  collision::Response response;
  response.status = collision::RecoveryStatus::recovered;
  response.cp_object_world_m = p;
  response.v_rec_world = v_rec;
  response.d_rec_m = exit->distance_m;
  response.d_rec_error_m = exit->error_m;
  response.cp_hull_world_m = p + exit->distance_m * v_rec;
  response.pixel_footprint_m = collision::pixel_footprint_m(hull.query, response.cp_hull_world_m);
  response.closed_form = collision::closed_form_normal(hull.query, {p, v_rec, 0.2, *exit});
  return response;
}

TEST(CoverageBorder, IsNearerToTheTrueHullThanThatOfObjectPixels) {
  for (const double radius_px : {6.0, 25.0}) {
    Random random(71);
    std::vector<double> binary_px, coverage_px, binary_deg, coverage_deg;
    for (int scene = 0; scene < 30; ++scene) {
      const Ball ball(random, radius_px);
      const Queries hull(ball.silhouettes);
      for (int i = 0; i < 10; ++i) {
        const Vector3d p = 0.8 * kRadius_m * random_direction(random);
        const Vector3d v_rec = (p.normalized() + 0.5 * random_in_ball(random, 1)).normalized();
        const auto [true_m, limiting] = ball.exit(p, v_rec);
        const Vector3d normal = ball.cone_normal(limiting, p + true_m * v_rec);
        const auto add = [&, true_m = true_m](const collision::Response& response,
                                              std::vector<double>& px, std::vector<double>& deg) {
          px.push_back(std::abs((response.cp_hull_world_m - p).norm() - true_m) /
                       response.pixel_footprint_m);
          ASSERT_EQ(response.closed_form.status, collision::NormalStatus::defined);
          deg.push_back(
              std::acos(std::clamp(response.closed_form.normal_world.dot(normal), -1.0, 1.0)) *
              180 / M_PI);
        };
        collision::Response response = response_of(hull, p, v_rec);
        const double d_rec_m = response.d_rec_m;
        add(response, binary_px, binary_deg);
        collision::refine_by_coverage(response, ball.covered, {});
        add(response, coverage_px, coverage_deg);
        EXPECT_EQ(response.d_rec_m, d_rec_m) << "the recovery stays certified";
      }
    }
    for (const auto& [what, px, deg] :
         {std::tuple("binary", &binary_px, &binary_deg), {"coverage", &coverage_px, &coverage_deg}})
      std::printf("%4.0f px, %-8s: CP_hull median %.3f, p95 %.3f px; N_hull %.2f, %.2f degrees\n",
                  radius_px, what, quantile_of(*px, 0.5), quantile_of(*px, 0.95),
                  quantile_of(*deg, 0.5), quantile_of(*deg, 0.95));
    EXPECT_LT(quantile_of(coverage_px, 0.5), quantile_of(binary_px, 0.5) / 3);
    EXPECT_LT(quantile_of(coverage_px, 0.95), quantile_of(binary_px, 0.95) / 2);
    EXPECT_LT(quantile_of(coverage_deg, 0.5), 0.75 * quantile_of(binary_deg, 0.5));
    EXPECT_LT(quantile_of(coverage_deg, 0.95), quantile_of(binary_deg, 0.95) / 2);
    EXPECT_LT(quantile_of(coverage_deg, 0.95) * M_PI / 180, collision::kCoverageNormalError_rad);
  }
}

TEST(CoverageBorder, LeavesAResponseThatItCannotImprove) {
  Random random(5);
  const Ball ball(random, 20);
  const Queries hull(ball.silhouettes);
  const Vector3d p = 0.8 * kRadius_m * Vector3d::UnitZ();
  const collision::Response response = response_of(hull, p, Vector3d::UnitZ());
  const auto refined = [&](collision::Response of,
                           std::span<const hull::CoverageSilhouette> covered) {
    collision::refine_by_coverage(of, covered, {});
    return of.cp_hull_world_m;
  };
  EXPECT_NE(refined(response, ball.covered), response.cp_hull_world_m);
  EXPECT_EQ(refined(response, {}), response.cp_hull_world_m);
  collision::Response no_exit = response;
  no_exit.status = collision::RecoveryStatus::no_exit_within_reach;
  EXPECT_EQ(refined(no_exit, ball.covered), response.cp_hull_world_m);
  // Coverage of another object.
  std::vector<hull::CoverageSilhouette> empty = ball.covered;
  for (hull::CoverageSilhouette& s : empty)
    s.map = hull::CoverageMap(s.map.width_px(), s.map.height_px());
  EXPECT_EQ(refined(response, empty), response.cp_hull_world_m);
  collision::Response not_requested = response;
  not_requested.closed_form = {};
  collision::refine_by_coverage(not_requested, ball.covered, {});
  EXPECT_EQ(not_requested.closed_form.status, collision::NormalStatus::not_requested);
}

// The box ends two pixels inside of the ball.
TEST(CoverageBorder, AFaceOfTheBoxStaysTheHullsEnd) {
  Random random(5);
  const Ball ball(random, 20);
  const Queries hull(ball.silhouettes);
  const Vector3d p = 0.8 * kRadius_m * Vector3d::UnitZ();
  collision::Response response = response_of(hull, p, Vector3d::UnitZ());
  hull::HullRule rule;
  response.cp_hull_world_m.z() -= 2 * response.pixel_footprint_m;
  rule.within_world_m.max().z() = response.cp_hull_world_m.z();
  const Vector3d at_face_m = response.cp_hull_world_m;
  collision::refine_by_coverage(response, ball.covered, rule);
  EXPECT_EQ(response.cp_hull_world_m, at_face_m);
}

}  // namespace
}  // namespace fivepipe::test
