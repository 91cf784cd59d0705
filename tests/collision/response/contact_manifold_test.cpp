// The contact manifold as input for a rigid-body solver.
#include "common/collision/response/contact_manifold.h"

#include <algorithm>
#include <iostream>
#include <set>
#include <stdexcept>

#include "common/collision/response/recovery.h"
#include "tests/support/collision_response.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

class ContactManifoldTest : public ResponseTest {
 protected:
  collision::ContactManifold manifold(int max_contacts = 4) {
    return collision::contact_manifold(query(), collision_, {rp_object_m_, max_contacts, 0.05});
  }
};

TEST_F(ContactManifoldTest, BoxOnPlaneContactsAreItsCorners) {
  see(plane_silhouettes());
  const double depth_m = 0.004;
  place(collision::world_triangles(geometry::box_mesh({0.04, 0.04, 0.02}),
                                   at({0.0011, 0.0007, 0.01 - depth_m})),
        {0.0011, 0.0007, 0.01 - depth_m});
  const collision::ContactManifold contacts = manifold();
  ASSERT_EQ(contacts.contacts.size(), 4u);
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

TEST_F(ContactManifoldTest, BallContactsHaveTheHullNormalAndLocallyMinimalDepth) {
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
      // Normal of the limiting camera's viewing cone around the real ball.
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
  std::cout << converged << " of " << contacts << " contacts converged; normals within "
            << worst_deg << " degrees of the analytic hull's\n";
  EXPECT_GT(converged, contacts / 3);
  EXPECT_LT(worst_deg, 0.05 * 180 / std::numbers::pi + 2);  // kConverged_rad and the fit
}

TEST_F(ContactManifoldTest, TwoContactsHaveTheirOwnNormals) {
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

TEST_F(ContactManifoldTest, ContactsAreOrderIndependentAndAtLeastAPixelApart) {
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

TEST_F(ContactManifoldTest, IgnoresOutsidePointsAndRejectsNonFiniteOnes) {
  place({0, 0, 0.082});
  collision_.points = {{{0, 0, 0.2}, 0}, {{0, 0, 0}, 1}};
  rp_object_m_ = {0, 0, 0.08};
  const collision::ContactManifold contacts =
      collision::contact_manifold(query(), collision_, {rp_object_m_, 4, 0.02});
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
