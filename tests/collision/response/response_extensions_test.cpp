// Beyond the paper: a shorter way out, and the contact manifold.
#include <algorithm>
#include <iostream>
#include <set>
#include <stdexcept>

#include "common/collision/response/contact_manifold.h"
#include "common/collision/response/local_minimum_translation.h"
#include "common/collision/response/recovery.h"
#include "tests/support/collision_response.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

class ResponseExtensions : public ResponseTest {
 protected:
  collision::LocalMinimumTranslation shorter(
      const collision::Response& response,
      const collision::LocalMinimumTranslationConfig& config = {}) {
    return collision::find_local_minimum_translation(query(), collision_, response, requery(),
                                                     config);
  }
  collision::ContactManifold manifold(int most = 4) {
    return collision::contact_manifold(query(), collision_, {rp_object_m_, most, 0.05});
  }
};

// What holds of every result.
void expect_kept(const collision::LocalMinimumTranslation& way, const collision::Response& response,
                 const collision::Requery& requery) {
  EXPECT_NEAR(way.move_world_m.norm(), way.length_m, 1e-12);
  if (way.status == collision::LocalMinimumTranslationStatus::not_free) {
    EXPECT_EQ(way.length_m, 0);
    return;
  }
  EXPECT_TRUE(requery(way.move_world_m).points.empty());
  EXPECT_LE(way.length_m, way.response_length_m);
  EXPECT_GE(way.response_length_m, response.clear_distance_m() + response.residual_m);
  EXPECT_LE(way.response_length_m, response.clear_distance_m() + response.residual_m +
                                       response.pixel_footprint_m + 2 * collision::kMaxRounding_m);
}

TEST_F(ResponseExtensions, EscapesAPlaneAlongItsNormal) {
  see(plane_silhouettes());
  place({0.001, 0.0005, kVirtualRadius_m - 0.008});
  ASSERT_TRUE(collision_.colliding());
  double deepest_m = 0;
  for (const collision::CollisionPoint& point : collision_.points)
    deepest_m = std::max(deepest_m, -point.p_world_m.z());
  for (const Vector3d& v_rec : {Vector3d(1, 0, 1), Vector3d(0.3, -1, 0.7), Vector3d(-2, 1, 1)}) {
    const collision::Response response = respond_to({rp_object_m_, v_rec, {}, kFlatness_m});
    ASSERT_TRUE(response.has_exit());
    const collision::LocalMinimumTranslation way = shorter(response);
    expect_kept(way, response, requery());
    EXPECT_EQ(way.status, collision::LocalMinimumTranslationStatus::found);
    EXPECT_LT(angle_rad(way.move_world_m, Vector3d(0, 0, 1)), 0.03);
    EXPECT_NEAR(way.length_m, deepest_m,
                3e-4);  // the least gain, and samples that come into the hull's border on the way
    EXPECT_LT(way.requeries, 32);
  }
}

TEST_F(ResponseExtensions, FindsNoTranslationShorterThanAnOptimalVRec) {
  see(plane_silhouettes());
  place({0, 0, kVirtualRadius_m - 0.008});
  const collision::Response response =
      respond_to({rp_object_m_, Vector3d(0, 0, 1), {}, kFlatness_m});
  ASSERT_EQ(response.status, collision::RecoveryStatus::recovered);
  const collision::LocalMinimumTranslation way = shorter(response);
  expect_kept(way, response, requery());
  EXPECT_EQ(way.status, collision::LocalMinimumTranslationStatus::none_found);
  EXPECT_EQ(way.length_m, way.response_length_m);
}

TEST_F(ResponseExtensions, LocalTranslationsAreVerifiedAndNeverLonger) {
  Random random(61);
  int found = 0, cases = 0;
  double sum = 0;
  for (int i = 0; i < 12; ++i) {
    std::vector<hull::Capsule> real;
    for (int c = 0; c < 2; ++c)
      real.push_back({random_in_ball(random, 0.03), random_in_ball(random, 0.03),
                      uniform(random, 0.008, 0.02)});
    see(real);
    place(collision::world_triangles(geometry::box_mesh({0.03, 0.02, 0.05}),
                                     at(random_in_ball(random, 0.03))),
          random_in_ball(random, 0.03));
    if (!collision_.colliding()) continue;
    const collision::Response response = respond_to({rp_object_m_, random_direction(random)});
    if (!response.has_exit()) continue;
    const collision::LocalMinimumTranslation way = shorter(response);
    expect_kept(way, response, requery());
    EXPECT_LE(way.requeries, 32);
    ++cases;
    if (way.status != collision::LocalMinimumTranslationStatus::found) continue;
    ++found;
    sum += way.length_m / way.response_length_m;
    auto shuffled = collision_;
    std::shuffle(shuffled.points.begin(), shuffled.points.end(), random);
    EXPECT_EQ(collision::find_local_minimum_translation(query(), shuffled, response, requery())
                  .move_world_m,
              way.move_world_m);
  }
  std::cout << "shorter ways found in " << found << " of " << cases << ", on average "
            << sum / found << " of the response's\n";
  EXPECT_GE(cases, 5);
  EXPECT_GE(found, cases / 2);
}

TEST_F(ResponseExtensions, LocalTranslationRespectsMaxRequeries) {
  see(plane_silhouettes());
  place({0, 0, kVirtualRadius_m - 0.008});
  const collision::Response response =
      respond_to({rp_object_m_, Vector3d(1, 0, 1), {}, kFlatness_m});
  int asked = 0;
  const auto counting = [&](const Vector3d& move_m) { return ++asked, moved(move_m); };
  for (const int most : {1, 2, 5}) {
    asked = 0;
    const collision::LocalMinimumTranslation way = collision::find_local_minimum_translation(
        query(), collision_, response, counting, {.max_requeries = most});
    EXPECT_LE(asked, most);
    EXPECT_EQ(asked, way.requeries);
    expect_kept(way, response, requery());
  }
}

TEST_F(ResponseExtensions, ReportsWhenNoTranslationFreesTheObject) {
  place({0, 0, 0.082});
  const collision::Response response = respond_by_default();
  ASSERT_TRUE(response.has_exit());
  const collision::ObjectCollision stuck = collision_;
  const collision::LocalMinimumTranslation way = collision::find_local_minimum_translation(
      query(), collision_, response, [&](const Vector3d&) { return stuck; });
  EXPECT_EQ(way.status, response.remaining_points.empty()
                            ? collision::LocalMinimumTranslationStatus::none_found
                            : collision::LocalMinimumTranslationStatus::not_free);
  collision::Response left = response;
  left.remaining_points = collision_.points;
  EXPECT_EQ(collision::find_local_minimum_translation(query(), collision_, left,
                                                      [&](const Vector3d&) { return stuck; })
                .status,
            collision::LocalMinimumTranslationStatus::not_free);
}

TEST_F(ResponseExtensions, LocalTranslationRequiresAnExit) {
  place({0, 0, 0.082});
  EXPECT_THROW(shorter(collision::Response{}), std::invalid_argument);
  const collision::Response response = respond_by_default();
  EXPECT_THROW(shorter(response, {.max_requeries = 0}), std::invalid_argument);
  EXPECT_THROW(shorter(response, {.min_gain_m = kNaN}), std::invalid_argument);
  EXPECT_THROW(collision::find_local_minimum_translation(query(), collision_, response, {}),
               std::invalid_argument);
}

TEST_F(ResponseExtensions, BoxOnPlaneContactsAreItsCorners) {
  see(plane_silhouettes());
  const double depth_m = 0.004;
  place(collision::world_triangles(geometry::box_mesh({0.04, 0.04, 0.02}),
                                   at({0.0011, 0.0007, 0.01 - depth_m})),
        {0.0011, 0.0007, 0.01 - depth_m});
  const collision::ContactManifold contacts = manifold();
  ASSERT_EQ(contacts.contacts.size(), 4u);
  EXPECT_EQ(contacts.points_in_hull, collision_.points.size());
  std::set<std::pair<bool, bool>> quadrants;
  for (const collision::Contact& contact : contacts.contacts) {
    ASSERT_EQ(contact.status, collision::ContactStatus::defined);
    EXPECT_TRUE(contact.converged);
    EXPECT_LT(angle_rad(contact.normal_world, Vector3d(0, 0, 1)), 1e-6);
    EXPECT_NEAR(contact.depth_m, -contact.on_object.p_world_m.z(), 1e-9);
    EXPECT_LT((contact.on_hull_world_m - contact.on_object.p_world_m -
               contact.depth_m * contact.normal_world)
                  .norm(),
              1e-12);
    const Vector3d from_center_m = contact.on_object.p_world_m - rp_object_m_;
    quadrants.insert({from_center_m.x() > 0, from_center_m.y() > 0});
    EXPECT_GT(std::abs(from_center_m.x()), 0.015);
    EXPECT_GT(std::abs(from_center_m.y()), 0.015);
  }
  EXPECT_EQ(quadrants.size(), 4u);
}

TEST_F(ResponseExtensions, BallContactsHaveTheHullNormalAndLocallyMinimalDepth) {
  Random random(62);
  int converged = 0, contacts = 0;
  double worst_deg = 0;
  for (int i = 0; i < 10; ++i) {
    place(above(kRealRadius_m + kVirtualRadius_m - 0.01, uniform(random, 0, 3.1),
                uniform(random, 0, 6.28)));
    ASSERT_TRUE(collision_.colliding());
    for (const collision::Contact& contact : manifold(8).contacts) {
      ASSERT_EQ(contact.status, collision::ContactStatus::defined);
      ++contacts;
      const Vector3d& p = contact.on_object.p_world_m;
      EXPECT_TRUE(inside(p + (contact.depth_m - contact.depth_error_m) * contact.normal_world));
      EXPECT_FALSE(inside(p + (contact.depth_m + contact.depth_error_m) * contact.normal_world));
      EXPECT_LE(contact.depth_error_m, collision::kMaxRounding_m);
      const auto to_reference =
          collision::exit_outward(query(), p, (rp_object_m_ - p).normalized(), 0.05);
      ASSERT_TRUE(to_reference);
      EXPECT_LE(contact.depth_m, to_reference->distance_m);
      if (!contact.converged) continue;
      ++converged;
      // The limiting camera's cone of sight round the real ball.
      const Vector3d eye = geometry::camera_center_world_m(
                         silhouettes_[std::size_t(contact.camera)].camera),
                     sight = (contact.on_hull_world_m - eye).normalized();
      const Vector3d away =
          contact.on_hull_world_m - (contact.on_hull_world_m.dot(eye) / eye.squaredNorm()) * eye;
      worst_deg =
          std::max(worst_deg, angle_rad(contact.normal_world, away - away.dot(sight) * sight) *
                                  180 / std::numbers::pi);
    }
  }
  std::cout << converged << " of " << contacts << " contacts converged, their normals within "
            << worst_deg << " degrees of the analytic hull's\n";
  EXPECT_GT(converged, contacts / 3);
  EXPECT_LT(worst_deg, 0.05 * 180 / std::numbers::pi + 2);  // as converged allows, and the fit
}

TEST_F(ResponseExtensions, ContactsAtTwoPlacesHaveTheirOwnNormals) {
  see({ball({-0.045, 0, 0}, 0.02), ball({0.045, 0, 0}, 0.02)});
  place(collision::world_triangles(geometry::box_mesh({0.06, 0.01, 0.01}), at(kOrigin)), kOrigin);
  bool left = false, right = false;
  for (const collision::Contact& contact : manifold().contacts) {
    ASSERT_EQ(contact.status, collision::ContactStatus::defined);
    left |= contact.on_object.p_world_m.x() < 0 && contact.normal_world.x() > 0.5;
    right |= contact.on_object.p_world_m.x() > 0 && contact.normal_world.x() < -0.5;
  }
  EXPECT_TRUE(left);
  EXPECT_TRUE(right);
}

TEST_F(ResponseExtensions, ContactsAreOrderIndependentAndAtLeastAPixelApart) {
  place({0.004, 0.001, 0.08});
  const collision::ContactManifold first = manifold(6);
  EXPECT_GE(first.contacts.size(), 3u);
  Random random(63);
  for (int i = 0; i < 5; ++i) {
    std::shuffle(collision_.points.begin(), collision_.points.end(), random);
    const collision::ContactManifold again = manifold(6);
    ASSERT_EQ(again.contacts.size(), first.contacts.size());
    for (std::size_t c = 0; c < first.contacts.size(); ++c) {
      EXPECT_EQ(again.contacts[c].on_object, first.contacts[c].on_object);
      EXPECT_EQ(again.contacts[c].depth_m, first.contacts[c].depth_m);
      EXPECT_EQ(again.contacts[c].normal_world, first.contacts[c].normal_world);
    }
  }
  for (std::size_t a = 0; a < first.contacts.size(); ++a)
    for (std::size_t b = 0; b < a; ++b)
      EXPECT_GT(
          (first.contacts[a].on_object.p_world_m - first.contacts[b].on_object.p_world_m).norm(),
          kFootprint_m * 0.9);
}

TEST_F(ResponseExtensions, PointsOutsideAndTooDeepAndNotFinite) {
  place({0, 0, 0.082});
  collision_.points = {{{0, 0, 0.2}, 0}, {{0, 0, 0}, 1}};
  rp_object_m_ = {0, 0, 0.08};
  const collision::ContactManifold contacts =
      collision::contact_manifold(query(), collision_, {rp_object_m_, 4, 0.02});
  EXPECT_EQ(contacts.points_in_hull, 1u);
  ASSERT_EQ(contacts.contacts.size(), 1u);
  EXPECT_EQ(contacts.contacts[0].status, collision::ContactStatus::no_exit_within_reach);
  EXPECT_TRUE(collision::contact_manifold(query(), {}, {rp_object_m_}).contacts.empty());
  EXPECT_THROW(collision::contact_manifold(query(), collision_, {rp_object_m_, 0}),
               std::invalid_argument);
  EXPECT_THROW(collision::contact_manifold(query(), collision_, {rp_object_m_, 4, kNaN}),
               std::invalid_argument);
  EXPECT_THROW(collision::contact_manifold(query(), collision_, {Vector3d(kNaN, 0, 0)}),
               std::invalid_argument);
  collision_.points[1].p_world_m.z() = kNaN;
  EXPECT_THROW(manifold(), std::invalid_argument);
}

}  // namespace
}  // namespace fivepipe::test
