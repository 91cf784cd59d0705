// The motion of the hull's parts between frames, and the contacts that objects keep on them.
#include "sim_node/contact/kept_contacts.h"
#include "sim_node/hull/current_hull.h"
#include "tests/support/sim_scene.h"

namespace fivepipe::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

// Turns about z by 2 rad/s around (1, 0, 0), which moves along x at 3 m/s.
sim::HullPart turning_part() {
  return {.id = 7,
          .box_world_m = {},
          .center_world_m = {1, 0, 0},
          .velocity_world_m_s = {3, 0, 0},
          .angular_velocity_world_rad_s = {0, 0, 2}};
}

TEST(HullPart, MovesRigidlyToItsPlaceAtTheNewestFrame) {
  const Isometry3d motion = sim::newest_from_before(turning_part(), 0.1);
  EXPECT_LT((motion * Vector3d(0.7, 0, 0) - Vector3d(1, 0, 0)).norm(), 1e-12) << "the centre";
  EXPECT_LT(
      (motion * Vector3d(0.8, 0, 0) - Vector3d(1 + 0.1 * std::cos(0.2), 0.1 * std::sin(0.2), 0))
          .norm(),
      1e-12);
}

TEST(HullPart, VelocityIsTheDerivativeOfTheMotion) {
  const sim::HullPart part = turning_part();
  const Vector3d at_newest_m(0.2, 0.5, -0.3);
  const auto place_m = [&](double before_s) {
    return Vector3d(sim::newest_from_before(part, before_s).inverse() * at_newest_m);
  };
  const double h = 1e-6;
  const Vector3d expected_m_s = (place_m(0.1 - h) - place_m(0.1 + h)) / (2 * h);
  EXPECT_LT((sim::velocity_before(part, 0.1).at(place_m(0.1)) - expected_m_s).norm(), 1e-8);
}

TEST(HullPart, RestsAtTheNewestFrameAndAfterIt) {
  for (const double before_s : {0.0, -0.1}) {
    EXPECT_EQ(sim::newest_from_before(turning_part(), before_s).matrix(),
              Isometry3d::Identity().matrix());
    EXPECT_EQ(sim::velocity_before(turning_part(), before_s).at({5, 5, 5}), kOrigin);
  }
}

TEST(HullPart, WithoutAHistoryTheWholeHullIsOnePartAtRest) {
  const auto silhouettes = seen({ball(kOrigin, 0.05)});
  sim::CurrentHull hull(scene_of({virtual_ball(kOrigin)}), {}, true, {});
  EXPECT_TRUE(hull.parts().empty());
  hull.set(0, silhouettes);
  ASSERT_EQ(hull.parts().size(), 1u);
  EXPECT_TRUE(hull.parts()[0].box_world_m.contains(Vector3d(1e9, -1e9, 0)));
  EXPECT_EQ(hull.parts()[0].velocity_world_m_s, kOrigin);
  EXPECT_EQ(hull.frames(), 1u);
}

// A ball at 0.6 m/s and one at rest.
TEST(HullPart, ATrackedComponentMovesAndOneAtRestDoesNot) {
  config::Scene scene = scene_of({virtual_ball(kOrigin)});
  scene.history.emplace();
  sim::CurrentHull hull(scene, {}, true, {Vector3d(-0.3, -0.3, -0.3), Vector3d(0.3, 0.3, 0.3)});
  std::vector<hull::Silhouette> silhouettes;
  for (int frame = 0; frame < 5; ++frame) {
    silhouettes = seen({ball({-0.15 + 0.02 * frame, 0, 0.1}, 0.03), ball({0.1, 0, -0.1}, 0.04)});
    hull.set(frame * kFrame_s, silhouettes);
    ASSERT_EQ(hull.parts().size(), 2u);
    const bool first_is_moving = hull.parts()[0].center_world_m.z() > 0;
    const sim::HullPart &moving = hull.parts()[first_is_moving ? 0 : 1],
                        &resting = hull.parts()[first_is_moving ? 1 : 0];
    EXPECT_EQ(resting.velocity_world_m_s, kOrigin) << frame;
    EXPECT_EQ(resting.angular_velocity_world_rad_s, kOrigin) << frame;
    if (frame == 0) {
      EXPECT_EQ(moving.velocity_world_m_s, kOrigin) << "not known yet";
    } else {
      // The hull's centroid moves by up to a tenth of a pixel against the ball's.
      EXPECT_LT((moving.velocity_world_m_s - Vector3d(0.6, 0, 0)).norm(), 0.1 * 0.002 / kFrame_s)
          << frame;
    }
  }
}

sim::KeptContact on_plane(const Vector3d& on_object_m, const Vector3d& on_hull_m,
                          std::uint64_t part = 0) {
  return {.part = part,
          .on_object_m = on_object_m,
          .on_hull_world_m = on_hull_m,
          .normal_world = Vector3d::UnitZ(),
          .footprint_m = 0.002};
}

TEST(KeptContacts, AreDroppedWhenTheObjectLiftsOrSlidesByAFootprint) {
  for (const auto& [move_m, keeps] : std::vector<std::pair<Vector3d, bool>>{
           {{0, 0, 0.0019}, true},
           {{0, 0, 0.0021}, false},
           {{0, 0, -0.05}, true},  // deeper is not away
           {{0.0019, 0, 0}, true},
           {{0.0015, -0.0015, 0}, false},
           {{std::numeric_limits<double>::quiet_NaN(), 0, 0}, false}}) {
    std::vector<sim::KeptContact> contacts = {on_plane({0, 0, -0.1}, {0, 0, -0.1}),
                                              on_plane({0, 0, -0.1}, {5, 0, 0}, 9)};
    sim::drop_left(contacts, 0, at(move_m));
    EXPECT_EQ(contacts.size(), keeps ? 2u : 1u) << move_m.transpose();
    EXPECT_EQ(contacts.back().part, 9u) << "another part is not concerned";
  }
}

// The hull is a box-like block with its top at z = 0 and pixels of 2 mm.
TEST(KeptContacts, FollowTheHullAsLongAsItsSurfaceIsNear) {
  const auto cameras = ring(5, 1.5, 0, 300, 0.6);
  const auto silhouettes = silhouettes_of({{{-0.1, 0, -0.05}, {0.1, 0, -0.05}, 0.05}}, cameras);
  sim::CurrentHull hull(scene_of({virtual_ball(kOrigin)}), {}, true, {});
  hull.set(0, silhouettes);
  const sim::HullPart still{.id = 3},
      moving{.id = 3, .center_world_m = {0, 0, 0}, .velocity_world_m_s = {0, 0, 0.3}};
  for (const auto& [z_m, part, keeps] :
       std::vector<std::tuple<double, sim::HullPart, bool>>{{0.0, still, true},
                                                            {0.0025, still, true},
                                                            {0.006, still, false},
                                                            {-0.0045, still, false},
                                                            {-0.03, moving, true},
                                                            {-0.03, still, false}}) {
    std::vector<sim::KeptContact> contacts = {on_plane(kOrigin, {0, 0, z_m}, 3)};
    sim::follow_hull(contacts, {&part, 1}, 0.1, *hull.query(), 0);
    ASSERT_EQ(contacts.size(), keeps ? 1u : 0u) << z_m;
    if (keeps) {
      EXPECT_NEAR(contacts[0].on_hull_world_m.z(), std::max(z_m, 0.0), 1e-12);
    }
  }
  // Within reach, the plane goes to the surface, and the surface's motion is returned.
  for (const auto& [z_m, reach_m, keeps] : std::vector<std::tuple<double, double, bool>>{
           {-0.02, 0.05, true}, {0.02, 0.05, true}, {-0.02, 0.015, false}, {0.02, 0.015, false}}) {
    std::vector<sim::KeptContact> contacts = {on_plane(kOrigin, {0, 0, z_m}, 3)};
    const std::vector<sim::SurfaceMotion> motions =
        sim::follow_hull(contacts, {&still, 1}, 0.1, *hull.query(), reach_m);
    ASSERT_EQ(contacts.size(), keeps ? 1u : 0u) << z_m;
    ASSERT_EQ(motions.size(), keeps ? 1u : 0u) << z_m;
    if (!keeps) continue;
    EXPECT_NEAR(contacts[0].on_hull_world_m.z(), 0, 0.003) << "about a pixel";
    EXPECT_EQ(motions[0].part, 3u);
    EXPECT_NEAR(motions[0].velocity_world_m_s.z(), -z_m / 0.1, 0.03);
  }
  // Two parts have become one: it keeps as many contacts as one part may.
  std::vector<sim::KeptContact> of_two;
  for (const std::uint64_t part : {5u, 6u})
    for (int i = 0; i < 4; ++i)
      of_two.push_back(on_plane({0.01 * i, 0, 0}, {0.01 * i, 0, 0}, part));
  const sim::HullPart merged{.id = 7};
  sim::follow_hull(of_two, {&merged, 1}, 0.1, *hull.query(), 0);
  EXPECT_EQ(of_two.size(), sim::kMaxHullContacts);
  for (const sim::KeptContact& contact : of_two) EXPECT_EQ(contact.part, 7u);
  // A turning part turns the normal: 0.05 rad about y in 0.1 s.
  const sim::HullPart turning{.id = 3, .angular_velocity_world_rad_s = {0, 0.5, 0}};
  std::vector<sim::KeptContact> turned = {on_plane(kOrigin, kOrigin, 3)};
  sim::follow_hull(turned, {&turning, 1}, 0.1, *hull.query(), 0);
  ASSERT_EQ(turned.size(), 1u);
  EXPECT_LT((turned[0].normal_world - Vector3d(std::sin(0.05), 0, std::cos(0.05))).norm(), 1e-9);
  // A part with a new id: the contact goes to it if its box contains the place.
  const sim::HullPart renamed{.id = 4};
  std::vector<sim::KeptContact> contacts = {on_plane(kOrigin, kOrigin, 3)};
  sim::follow_hull(contacts, {&renamed, 1}, 0.1, *hull.query(), 0);
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_EQ(contacts[0].part, 4u);
  const sim::HullPart elsewhere{.id = 5, .box_world_m = {Vector3d(1, 1, 1), Vector3d(2, 2, 2)}};
  sim::follow_hull(contacts, {&elsewhere, 1}, 0.1, *hull.query(), 0);
  EXPECT_TRUE(contacts.empty());
}

sim::KeptContact measured(const Vector3d& on_object_m, double depth_m,
                          const Vector3d& normal = Vector3d::UnitZ()) {
  sim::KeptContact contact = on_plane(on_object_m, on_object_m + depth_m * normal);
  contact.normal_world = normal;
  return contact;
}

class AddContacts : public testing::Test {
 protected:
  void add(const std::vector<sim::KeptContact>& measured) {
    sim::add_contacts(kept_, 0, measured, at(kOrigin));
  }
  std::vector<sim::KeptContact> kept_;
};

TEST_F(AddContacts, ContactsOnOnePlaneShareIt) {
  add({measured({0, 0, 0}, 0.002)});
  const Vector3d tilted = Vector3d(0.05, 0, 1).normalized();
  add({measured({0.1, 0, 0}, 0.0035, tilted)});
  ASSERT_EQ(kept_.size(), 2u);
  EXPECT_EQ(kept_[1].normal_world, Vector3d::UnitZ());
  EXPECT_NEAR(sim::distance_m(kept_[1], at(kOrigin)), -0.002, 1e-12) << "that of the first plane";
}

TEST_F(AddContacts, AnotherPlaneIsKeptAsMeasured) {
  const Vector3d tilted = Vector3d(0.2, 0, 1).normalized();
  add({measured({0, 0, 0}, 0.002), measured({0.1, 0, 0}, 0.009),
       measured({0, 0.1, 0}, 0.002, tilted)});
  ASSERT_EQ(kept_.size(), 3u);
  EXPECT_NEAR(sim::distance_m(kept_[1], at(kOrigin)), -0.009, 1e-12);
  EXPECT_EQ(kept_[2].normal_world, tilted);
}

TEST_F(AddContacts, APlaceOnAKeptPlaneIsKeptOnce) {
  add({measured({0, 0, 0}, 0.002)});
  add({measured({0.001, 0, 0}, 0.003)});
  EXPECT_EQ(kept_.size(), 1u);
  add({measured({0.004, 0, 0}, 0.003)});
  EXPECT_EQ(kept_.size(), 2u);
}

// It rolls: its point is always below the centre.
TEST_F(AddContacts, ABallHasOneContactPerPlane) {
  sim::KeptContact contact = measured({0, 0, -0.05}, 0.002);
  contact.ball_radius_m = 0.05;
  add({contact});
  contact.on_object_m = {0.05, 0, 0};
  add({contact});
  ASSERT_EQ(kept_.size(), 1u);
  Isometry3d rolled = at({0.001, 0, 0.0005});
  rolled.linear() = Eigen::AngleAxisd(1, Vector3d::UnitY()).matrix();
  EXPECT_LT((sim::point_world_m(kept_[0], rolled) - Vector3d(0.001, 0, -0.0495)).norm(), 1e-12);
}

TEST_F(AddContacts, KeepsTheDeepestAndTheFarthestOfAPart) {
  kept_.push_back(on_plane({9, 9, 9}, kOrigin, 5));
  std::vector<sim::KeptContact> many;
  for (int x = -2; x <= 2; ++x)
    for (int y = -2; y <= 2; ++y)
      many.push_back(measured({0.02 * x, 0.02 * y, 0}, x == 1 && y == 1 ? 0.003 : 0.002));
  // All on one side, but on different planes, so that each keeps its depth.
  for (std::size_t i = 0; i < many.size(); ++i)
    many[i] = measured(many[i].on_object_m, -sim::distance_m(many[i], at(kOrigin)),
                       Eigen::AngleAxisd(0.12 * (double(i / 5) - 2), Vector3d::UnitX()) *
                           Eigen::AngleAxisd(0.12 * (double(i % 5) - 2), Vector3d::UnitY()) *
                           Vector3d::UnitZ());
  add(many);
  ASSERT_EQ(kept_.size(), 1 + sim::kMaxHullContacts);
  EXPECT_EQ(kept_[0].part, 5u) << "another part has contacts of its own";
  const auto has = [&](double x, double y) {
    return std::any_of(kept_.begin(), kept_.end(), [&](const sim::KeptContact& contact) {
      return (contact.on_object_m - Vector3d(x, y, 0)).norm() < 1e-12;
    });
  };
  EXPECT_TRUE(has(0.02, 0.02)) << "the deepest";
  EXPECT_TRUE(has(-0.04, -0.04)) << "the farthest from it";
}

// A block on the floor that a wall of the same part pushes: the wall is deeper in it.
TEST_F(AddContacts, OfTwoSidesKeepsBoth) {
  std::vector<sim::KeptContact> both;
  for (int x = 0; x < 4; ++x)
    for (int y = 0; y < 4; ++y) {
      both.push_back(measured({-0.03, 0.02 * x, 0.01 + 0.02 * y}, 0.003, Vector3d::UnitX()));
      both.push_back(measured({0.02 * x, 0.02 * y, 0}, 0.0001));
    }
  add(both);
  ASSERT_EQ(kept_.size(), sim::kMaxHullContacts);
  const auto of_floor = std::count_if(kept_.begin(), kept_.end(), [](const auto& contact) {
    return contact.normal_world == Vector3d::UnitZ();
  });
  EXPECT_GT(of_floor, 0);
  EXPECT_LT(of_floor, std::ptrdiff_t(sim::kMaxHullContacts));
}

}  // namespace
}  // namespace fivepipe::test
