// The response's hard cases that are not in response_test.cpp (RP_obj in the hull or at CP_obj,
// V_rec, object in the hull, two contacts) nor in response_normals_test.cpp (edge and corner).
#include <algorithm>

#include "tests/support/collision/response.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

class ResponseEdgeCases : public ResponseTest {
 protected:
  void expect_same(const collision::Response& a, const collision::Response& b) {
    EXPECT_EQ(a.status, b.status);
    EXPECT_EQ(a.cp_object_world_m, b.cp_object_world_m);
    EXPECT_EQ(a.d_rec_m, b.d_rec_m);
    EXPECT_EQ(a.d_rec_error_m, b.d_rec_error_m);
    EXPECT_EQ(a.residual_m, b.residual_m);
    EXPECT_EQ(a.four_points.normal_world, b.four_points.normal_world);
    EXPECT_EQ(a.closed_form.normal_world, b.closed_form.normal_world);
  }
};

TEST_F(ResponseEdgeCases, SphereOnPlaneHasADeterministicCpObject) {
  see(plane_silhouettes());
  place({0.0013, -0.0007, kVirtualRadius_m - 0.006});
  ASSERT_TRUE(collision_.colliding());
  const collision::Response response = respond_by_default();
  EXPECT_EQ(response.status, collision::RecoveryStatus::recovered);
  // CP_obj is the deepest point, not only the farthest: nearly below the centre, so that V_rec is
  // nearly vertical.
  EXPECT_LT((response.cp_object_world_m - rp_object_m_).head<2>().norm(), 0.004);
  EXPECT_NEAR(response.cp_hull_world_m.z(), 0, 1e-9);
  ASSERT_EQ(response.closed_form.status, collision::NormalStatus::defined);
  EXPECT_LT(angle_rad(response.closed_form.normal_world, Vector3d(0, 0, 1)), 1e-6);
  Random random(81);
  for (int i = 0; i < 10; ++i) {
    std::shuffle(collision_.points.begin(), collision_.points.end(), random);
    expect_same(respond_by_default(), response);
  }
}

TEST_F(ResponseEdgeCases, TiesBreakByTriangleThenPosition) {
  see(plane_silhouettes());
  rp_object_m_ = {0, 0, 0.02};
  std::vector<collision::CollisionPoint> points{{{0.01, 0, -0.01}, 7},
                                                {{-0.01, 0, -0.01}, 7},
                                                {{0, 0.01, -0.01}, 7},
                                                {{0, -0.01, -0.01}, 9},
                                                {{0, 0.005, -0.01}, 2}};
  std::sort(points.begin(), points.end(),
            [](const auto& a, const auto& b) { return a.p_world_m.y() < b.p_world_m.y(); });
  for (const double equally_far_m : {0.0, 0.001}) {
    std::optional<collision::Response> first;
    std::vector<std::size_t> order{0, 1, 2, 3, 4};
    do {
      collision_.verdict = collision::CollisionVerdict::colliding;
      collision_.points.clear();
      for (const std::size_t i : order) collision_.points.push_back(points[i]);
      const auto free = [](const Vector3d&) { return collision::ObjectCollision{}; };
      const collision::Response response = collision::respond(
          query(), collision_, {rp_object_m_, std::nullopt, {true, true}, equally_far_m}, free);
      if (!first) first = response;
      ASSERT_NO_FATAL_FAILURE(expect_same(response, *first));
    } while (std::next_permutation(order.begin(), order.end()));
    EXPECT_EQ(first->cp_object_world_m, Vector3d(-0.01, 0, -0.01));
  }
}

TEST_F(ResponseEdgeCases, RecoveryIntoAnotherComponentIsStillColliding) {
  // A bar above a ball. The lower end of a needle is in the ball; after the move upward, its other
  // end is in the bar.
  see({ball({0, 0, -0.03}, 0.02), {{-0.05, 0, 0.015}, {0.05, 0, 0.015}, 0.006}});
  const Vector3d tip(0, 0, -0.02), a(0.003, 0, 0.004), b(-0.002, 0.002, 0.004),
      c(-0.002, -0.002, 0.004);
  place({{tip, b, a}, {tip, c, b}, {tip, a, c}, {a, b, c}}, {0, 0, 0});
  ASSERT_TRUE(collision_.colliding());
  const collision::Response response =
      respond_to({rp_object_m_, Vector3d(0, 0, 1)}, {.search = collision::HullSearch::outward});
  EXPECT_EQ(response.status, collision::RecoveryStatus::still_colliding);
  EXPECT_GT(response.residual_m, response.indifferent_m());
  ASSERT_FALSE(response.remaining_points.empty());
  for (const collision::CollisionPoint& point : response.remaining_points)
    EXPECT_GT(point.p_world_m.z(), 0.008);  // in the bar, not in the ball
  // The residual leads through the bar.
  EXPECT_TRUE(
      moved((response.clear_distance_m() + response.residual_m + 1e-6) * response.v_rec_world)
          .points.size() < response.remaining_points.size());
}

TEST_F(ResponseEdgeCases, HullInsideTheObjectHasNoCollisionPoint) {
  see({ball(kOrigin, 0.01)});
  place(collision::world_triangles(geometry::box_mesh({0.08, 0.08, 0.08}), at(kOrigin)), kOrigin);
  EXPECT_EQ(collision_.verdict, collision::CollisionVerdict::undecided);
  EXPECT_TRUE(collision_.points.empty());
  bool requeried = false;
  const collision::Response response =
      collision::respond(query(), collision_, {kOrigin, std::nullopt}, [&](const Vector3d&) {
        requeried = true;
        return collision::ObjectCollision{};
      });
  EXPECT_EQ(response.status, collision::RecoveryStatus::no_collision_point);
  EXPECT_FALSE(response.has_exit());
  EXPECT_FALSE(requeried);
}

TEST_F(ResponseEdgeCases, ObjectInsideTheHullExitsAlongAGivenDirection) {
  place(collision::world_triangles(geometry::sphere_mesh(0.01, 1), at(kOrigin)), kOrigin);
  ASSERT_TRUE(collision_.colliding());
  const collision::Response response = respond_to({kOrigin, Vector3d(0, 0, 3)}, {.height_m = 0.1});
  // CP_obj has left the hull, the rest of the ball has not.
  EXPECT_EQ(response.status, collision::RecoveryStatus::still_colliding);
  EXPECT_GT(response.residual_m, 0);
  EXPECT_LE(response.residual_m, 0.1);
  EXPECT_TRUE(
      moved((response.clear_distance_m() + response.residual_m + 1e-6) * response.v_rec_world)
          .points.empty());
}

TEST_F(ResponseEdgeCases, OutwardSearchTowardsAReferenceInTheHullHasNoExit) {
  place({0, 0, 0.03});
  ASSERT_TRUE(inside(rp_object_m_));
  EXPECT_EQ(respond_by_default({.search = collision::HullSearch::outward}).status,
            collision::RecoveryStatus::no_exit_within_reach);  // all of V_rec is in the hull
  collision_.points = {{rp_object_m_, 0}};
  EXPECT_EQ(respond_by_default({.search = collision::HullSearch::outward}).status,
            collision::RecoveryStatus::direction_undefined);
}

TEST_F(ResponseEdgeCases, StalePointsInAnEmptyHullAreRecoveredAtOnce) {
  place({0, 0, 0.083});
  ASSERT_TRUE(collision_.colliding());
  see(std::vector<hull::Silhouette>{});
  const collision::Response response = respond_by_default();
  EXPECT_EQ(response.status, collision::RecoveryStatus::recovered);
  EXPECT_EQ(response.d_rec_m, 0);
  EXPECT_EQ(response.closed_form.status, collision::NormalStatus::no_border);
}

TEST_F(ResponseEdgeCases, AllResultsAreFinite) {
  Random random(82);
  const auto finite = [](const collision::Response& r) {
    const double sum = r.d_rec_m + r.d_rec_error_m + r.residual_m + r.pixel_footprint_m +
                       r.closed_form.error_rad + r.four_points.error_rad;
    return std::isfinite(sum) && r.cp_object_world_m.allFinite() && r.v_rec_world.allFinite() &&
           r.cp_hull_world_m.allFinite() && r.four_points.normal_world.allFinite() &&
           r.closed_form.normal_world.allFinite();
  };
  for (int i = 0; i < 5; ++i) {
    std::vector<hull::Silhouette> noise;
    for (int c = 0; c < 2; ++c) {
      const Vector3d eye = random_direction(random), up = random_direction(random);
      noise.push_back(
          {camera_at(eye, 64, kField_m, kOrigin, up), random_pixels(random, 64, 64, 0.7)});
    }
    see(noise);
    place(random_in_ball(random, 0.05));
    for (const collision::HullSearch search :
         {collision::HullSearch::from_reference, collision::HullSearch::outward,
          collision::HullSearch::sampled}) {
      const collision::Response response = respond_to(
          {rp_object_m_, random_direction(random), {true, true}, kFlatness_m}, {.search = search});
      EXPECT_TRUE(finite(response));
      if (response.has_exit()) {
        EXPECT_FALSE(inside(response.cp_object_world_m +
                            response.clear_distance_m() * response.v_rec_world));
      }
    }
  }
}

}  // namespace
}  // namespace fivepipe::test
