// The contact manifold as input for a rigid-body solver.
#include "common/collision/response/contact_manifold.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <limits>
#include <set>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "common/collision/response/farthest_point_sample.h"
#include "common/collision/response/recovery.h"
#include "tests/support/collision/response.h"
#include "tests/support/not_finite.h"

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
    place(random_above(random, 0.01, 0.01, 3.1));
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
  EXPECT_EQ(contacts.contacts[0].depth_error_m, 0);
  EXPECT_EQ(contacts.contacts[0].normal_error_rad, 0);
  EXPECT_TRUE(collision::contact_manifold(query(), {}, {rp_object_m_}).contacts.empty());
  EXPECT_THROW(collision::contact_manifold(query(), collision_, {rp_object_m_, 0}),
               std::invalid_argument);
  for (const double reach_m : {kNaN, kInfinity, 0.0})
    EXPECT_THROW(collision::contact_manifold(query(), collision_, {rp_object_m_, 4, reach_m}),
                 std::invalid_argument);
  EXPECT_THROW(collision::contact_manifold(query(), collision_, {Vector3d(kNaN, 0, 0)}),
               std::invalid_argument);
  collision_.points[1].p_world_m.z() = kNaN;
  EXPECT_THROW(manifold(), std::invalid_argument);
}

// Each next point maximises the distance to the nearest one taken; of equals, the first in
// lexicographic order of the coordinates is taken.
TEST(FarthestPointSample, TakesTheFarthestOfTheRestUntilTheyAreTooNear) {
  Random random(64);
  for (int scene = 0; scene < 200; ++scene) {
    std::vector<Vector3d> points;
    for (int i = 0; i < 1 + scene % 30; ++i)  // on a coarse grid, so that distances are often equal
      points.push_back({std::floor(uniform(random, 0, 4)), std::floor(uniform(random, 0, 3)),
                        std::floor(uniform(random, 0, 2))});
    const std::size_t first = random() % points.size(), count = 1 + random() % 12;
    const double min_m = std::array{0.0, 1.0, 1.2}[std::size_t(scene % 3)];
    std::vector<std::size_t> expected{first};
    while (expected.size() < count) {
      const auto to_taken2 = [&](std::size_t i) {
        double least = std::numeric_limits<double>::infinity();
        for (const std::size_t t : expected)
          least = std::min(least, (points[i] - points[t]).squaredNorm());
        return least;
      };
      const auto key = [&](std::size_t k) {
        return std::tuple(-to_taken2(k), points[k].x(), points[k].y(), points[k].z());
      };
      std::size_t best = 0;
      for (std::size_t i = 1; i < points.size(); ++i)
        if (key(i) < key(best)) best = i;
      if (!(to_taken2(best) > min_m * min_m)) break;
      expected.push_back(best);
    }
    const auto found = collision::farthest_point_sample(points, {first}, count, min_m);
    ASSERT_EQ(found.size(), expected.size()) << scene;
    for (std::size_t i = 0; i < found.size(); ++i)
      EXPECT_EQ(points[found[i]], points[expected[i]]) << scene << ' ' << i;
    EXPECT_EQ(found[0], first);
  }
}

TEST(FarthestPointSample, ContinuesASample) {
  Random random(73);
  std::vector<Vector3d> points;
  for (int i = 0; i < 100; ++i) points.push_back(test::random_in_ball(random, 1));
  const auto all = collision::farthest_point_sample(points, {7}, 20, 0);
  EXPECT_EQ(collision::farthest_point_sample(points, {all.begin(), all.begin() + 9}, 20, 0), all);
  EXPECT_EQ(collision::farthest_point_sample(points, all, 5, 0), all) << "no point is dropped";
}

TEST(OutermostPoint, IsFarthestFromTheCentroid) {
  EXPECT_EQ(collision::outermost_point(std::vector<Vector3d>{{3, 3, 3}}), 0u);
  // The centroid is at x = 2.5; of the equally far ends it is the one with the smaller x.
  const std::vector<Vector3d> line{{2, 0, 0}, {4, 0, 0}, {1, 0, 0}, {3, 0, 0}};
  EXPECT_EQ(collision::outermost_point(line), 2u);
  EXPECT_EQ(collision::outermost_point(std::vector<Vector3d>{{0, 0, 0}, {1, 0, 0}, {9, 0, 0}}), 2u);
}

// The corners and centres of a square grid, turned and moved by less than a tenth of a nanometre:
// many distances are equal but for rounding, which must not choose.
TEST(FarthestPointSample, ChoosesTheSameAmongEquallyFarPointsWhateverTheirLastBits) {
  Random random(71);
  for (int scene = 0; scene < 100; ++scene) {
    const Eigen::AngleAxisd turn(uniform(random, 0.1, 3), Vector3d(1, 2, 3).normalized());
    std::vector<Vector3d> points, moved;
    for (int i = 0; i < 9; ++i)
      for (int j = 0; j < 9; ++j) {
        points.push_back(turn * Vector3d(0.01 * i, 0.01 * j, 0));
        moved.push_back(points.back() + test::random_in_ball(random, 1e-10));
      }
    EXPECT_EQ(collision::farthest_point_sample(points, {40}, 16, 0),
              collision::farthest_point_sample(moved, {40}, 16, 0))
        << scene;
  }
}

// With fewer points than the search samples, the first contact is the deepest one towards RP_obj,
// and the others are a farthest-point sample. A contact without an exit has no camera and depth 0.
TEST_F(ContactManifoldTest, StartsWithTheDeepestPointAndFollowsTheFarthestSample) {
  Random random(65);
  int no_exit = 0;
  for (int i = 0; i < 6; ++i) {
    place(random_above(random, 0.002, 0.012, 3.1));
    std::shuffle(collision_.points.begin(), collision_.points.end(), random);
    collision_.points.resize(std::min<std::size_t>(collision_.points.size(), 60));
    const double reach_m = i % 3 ? 0.05 : 0.003;
    const auto depth_m = [&](const Vector3d& p) {
      const auto exit =
          collision::exit_outward(query(), p, (rp_object_m_ - p).normalized(), reach_m);
      return exit ? exit->distance_m : reach_m;
    };
    const auto found =
        collision::contact_manifold(query(), collision_, {rp_object_m_, 5, reach_m}).contacts;
    ASSERT_FALSE(found.empty());
    double deepest_m = 0;
    std::vector<Vector3d> positions;
    for (const collision::CollisionPoint& p : collision_.points) {
      deepest_m = std::max(deepest_m, depth_m(p.p_world_m));
      positions.push_back(p.p_world_m);
    }
    EXPECT_GT(depth_m(found[0].on_object.p_world_m), deepest_m - 1.5 * kFootprint_m) << i;
    const auto first =
        std::size_t(std::find(positions.begin(), positions.end(), found[0].on_object.p_world_m) -
                    positions.begin());
    const double footprint_m = collision::pixel_footprint_m(query(), positions[first]);
    EXPECT_NEAR(footprint_m, kFootprint_m, 0.1 * kFootprint_m);
    const auto sample = collision::farthest_point_sample(positions, {first}, 5, footprint_m);
    ASSERT_EQ(found.size(), sample.size());
    for (std::size_t k = 0; k < sample.size(); ++k) {
      EXPECT_EQ(found[k].on_object.p_world_m, positions[sample[k]]) << i << ' ' << k;
      if (found[k].status == collision::ContactStatus::no_exit_within_reach) {
        ++no_exit;
        EXPECT_EQ(found[k].camera, -1);
        EXPECT_EQ(found[k].depth_m, 0);
        EXPECT_FALSE(found[k].converged);
        continue;
      }
      EXPECT_LT(found[k].depth_m, reach_m);
      EXPECT_GE(found[k].camera, 0);
      EXPECT_GT(found[k].normal_error_rad, 0);
      EXPECT_GT(found[k].depth_error_m, 0);
    }
  }
  EXPECT_GT(no_exit, 0);
}

// RP_obj is the point itself, so the axes are tried: the nearest exit of a plate is up or down.
TEST_F(ContactManifoldTest, WithoutADirectionItTakesTheNearestAxis) {
  std::vector<hull::Silhouette> silhouettes = plane_silhouettes();  // z < 0, down to z = -0.04
  for (hull::Silhouette& s : silhouettes) {
    hull::ObjectPixels pixels(kImage_px, kImage_px);
    for (int v = kImage_px / 2; v < kImage_px / 2 + 80; ++v) pixels.set_run(10, kImage_px - 10, v);
    s.pixels = pixels;
  }
  see(silhouettes);
  for (const auto& [z_m, up] : {std::pair{-0.01, true}, {-0.03, false}}) {
    collision_.points = {{{0.001, 0.002, z_m}, 4}};
    const auto contacts =
        collision::contact_manifold(query(), collision_, {{0.001, 0.002, z_m}, 4, 0.05}).contacts;
    ASSERT_EQ(contacts.size(), 1u);
    EXPECT_EQ(contacts[0].status, collision::ContactStatus::defined);
    EXPECT_NEAR(contacts[0].depth_m, 0.01, 5e-4);
    EXPECT_LT(angle_rad(contacts[0].normal_world, Vector3d(0, 0, up ? 1 : -1)), 0.05);
    EXPECT_EQ(contacts[0].on_object.triangle, 4u);
  }
}

}  // namespace
}  // namespace fivepipe::test
