// Rigid contact with the hull: the times of the queries, the distance and speed with which an
// object leaves the hull, and the counters.
#include "sim_node/contact/rigid_contact.h"

#include "sim_node/contact/bounce.h"
#include "tests/support/sim_scene.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

constexpr double kQueryPeriod_s = 1.0 / 120;

// A real bar with a radius of 3 cm, seen by cameras on its horizon.
hull::Capsule bar(double x_m) { return {{x_m, -0.15, 0}, {x_m, 0.15, 0}, 0.03}; }
std::vector<hull::Silhouette> bars(const std::vector<hull::Capsule>& real) {
  std::vector<geometry::Camera> cameras = ring(3, 1.5, 0.6, 300, 0.6);
  for (const double y_m : {-1.5, 1.5}) cameras.push_back(camera_at({0, y_m, 0}, 300, 0.6));
  return silhouettes_of(real, cameras);
}

// A rigid contact and all that it borrows.
struct Contacts {
  Contacts(const std::vector<config::SceneObject>& objects,
           const std::vector<hull::Silhouette>& silhouettes, double step_s = kQueryPeriod_s)
      : scene(scene_of(objects)), config{.step_s = step_s}, seen(silhouettes) {
    hull.set(0, seen);
  }

  config::Scene scene;
  config::SimConfig config;
  std::vector<hull::Silhouette> seen;
  sim::ObjectModels models = sim::object_models(scene);
  sim::RigidBodies bodies{scene};
  sim::CurrentHull hull{scene, config, true, {}};
  sim::RigidContact contact{scene, config, models, bodies, hull};

  Vector3d center_m() const { return bodies.center_world_m(0); }

  // The response of section 4.4 to a contact of the object at its present place.
  collision::Response response_to(const collision::ObjectCollision& collision) {
    return collision::respond(
        *hull.query(), collision,
        {.rp_object_world_m = center_m(),
         .v_rec_world = std::nullopt,
         .normals = {.four_points = true, .closed_form = false},
         .equally_far_m = models.objects[0].flatness_m},
        hull.requery(sim::detection_object(models, bodies, 0)),
        {.height_m = models.objects[0].radius_m, .apex_angle_rad = std::numbers::pi / 3});
  }
};

TEST(RigidContact, QueriesTheHullEvery120thOfASecond) {
  const auto silhouettes = bars({bar(0)});
  const std::vector<std::pair<double, std::size_t>> steps_per_query = {
      {1.0 / 480, 4}, {1.0 / 240, 2}, {1.0 / 200, 2}, {1.0 / 120, 1}, {1.0 / 60, 1}, {0.1, 1}};
  for (const auto& [step_s, steps] : steps_per_query) {
    Contacts away({virtual_ball({0, 0, 1})}, silhouettes, step_s);
    for (std::size_t step = 1; step <= 12; ++step) {
      away.contact.after_step();
      EXPECT_EQ(away.hull.counts().objects, step / steps) << step_s << " s, step " << step;
    }
    if (steps == 1) continue;
    const std::size_t before = away.hull.counts().objects;
    away.contact.after_step();
    away.contact.reset();
    for (std::size_t step = 1; step <= steps; ++step) {
      EXPECT_EQ(away.hull.counts().objects, before) << step;
      away.contact.after_step();
    }
    EXPECT_EQ(away.hull.counts().objects, before + 1);
  }
}

TEST(RigidContact, MovesABallOutByTheResponseToItsContact) {
  const auto silhouettes = bars({bar(0)});
  const Vector3d center_m(0.01, 0.005, 0.085), velocity_m_s(0.1, 0.2, -1);
  Contacts one({virtual_ball(center_m, 0.7)}, silhouettes);
  one.bodies.set_velocity_m_s(0, velocity_m_s);
  Contacts same({virtual_ball(center_m, 0.7)}, silhouettes);
  one.contact.after_step();
  const auto contact = one.contact.take_contact(0);
  ASSERT_TRUE(contact);
  EXPECT_TRUE(contact->collision.colliding());
  EXPECT_EQ(contact->object.rp_object_world_m, center_m);
  EXPECT_EQ(contact->object.world_from_object.translation(), center_m);
  const collision::Response expected = same.response_to(contact->collision);
  ASSERT_EQ(expected.status, collision::RecoveryStatus::recovered);
  EXPECT_EQ(contact->response.status, expected.status);
  EXPECT_NEAR(contact->response.d_rec_m, expected.d_rec_m, 1e-12);
  ASSERT_EQ(expected.four_points.status, collision::NormalStatus::defined);
  EXPECT_LT((contact->response.four_points.normal_world - expected.four_points.normal_world).norm(),
            1e-9);
  EXPECT_NEAR(contact->response.four_points.error_rad, expected.four_points.error_rad, 1e-9);
  EXPECT_EQ(contact->response.closed_form.status, collision::NormalStatus::not_requested);
  const sim::Bounce after = sim::bounce(expected, velocity_m_s, 0.7, kGravity_m_s2, 0.2);
  EXPECT_LT((one.center_m() - center_m - after.move_world_m).norm(), 1e-9);
  EXPECT_GT(after.move_world_m.norm(), 1e-3);
  EXPECT_LT((one.bodies.velocity_m_s(0) - after.velocity_world_m_s).norm(), 1e-9);
  EXPECT_EQ(one.contact.counters().contacts, 1u);
  EXPECT_EQ(one.contact.counters().unrecovered, 0u);
  EXPECT_EQ(one.contact.counters().still_colliding, 0u);
  EXPECT_FALSE(one.contact.take_contact(0)) << "taken";
}

// An object that is slower than after a fall of two query periods comes to rest; a faster one
// bounces.
TEST(RigidContact, RestingSpeedIsThatOfTwoQueryPeriods) {
  const auto silhouettes = bars({bar(0)});
  const std::vector<std::pair<double, double>> speeds_m_s = {{1.0 / 480, 2 * kGravity_m_s2 / 120},
                                                             {1.0 / 120, 2 * kGravity_m_s2 / 120},
                                                             {1.0 / 60, 2 * kGravity_m_s2 / 60}};
  for (const auto& [step_s, resting_m_s] : speeds_m_s)
    for (const double factor : {0.9, 1.1}) {
      // From the side, so that no lift takes energy.
      Contacts moving({virtual_ball({0.0895, 0, 0}, 1)}, silhouettes, step_s);
      const double speed_m_s = factor * resting_m_s;
      moving.bodies.set_velocity_m_s(0, {-speed_m_s, 0, 0});
      for (int step = 0; step < 4 && moving.contact.counters().contacts == 0; ++step)
        moving.contact.after_step();
      const auto contact = moving.contact.take_contact(0);
      ASSERT_TRUE(contact && contact->response.has_exit());
      EXPECT_NEAR(moving.bodies.velocity_m_s(0).x(), factor < 1 ? 0 : speed_m_s, 0.2 * speed_m_s)
          << step_s;
    }
}

// The gap between the two bars is narrower than the ball, so each move ends in the other bar.
TEST(RigidContact, MovesOutOfOneContactAtATimeAtMostFourTimes) {
  const auto silhouettes = bars({bar(-0.08), bar(0.08)});
  const Vector3d center_m(0.012, 0, 0);
  Contacts squeezed({virtual_ball(center_m, 0.5)}, silhouettes);
  Contacts same({virtual_ball(center_m, 0.5)}, silhouettes);
  squeezed.contact.after_step();
  auto contact = squeezed.contact.take_contact(0);
  ASSERT_TRUE(contact);
  collision::ObjectCollision remaining = contact->collision;
  double last_residual_m = 0;
  for (int move = 0; move < 4; ++move) {
    const collision::Response response = same.response_to(remaining);
    ASSERT_EQ(response.status, collision::RecoveryStatus::still_colliding) << move;
    if (move == 0) {
      EXPECT_NEAR(contact->response.d_rec_m, response.d_rec_m, 1e-12) << "that of the first move";
      EXPECT_EQ(contact->response.status, response.status);
    }
    const sim::Bounce after =
        sim::bounce(response, same.bodies.velocity_m_s(0), 0.5, kGravity_m_s2, 0.2);
    same.bodies.translate(0, after.move_world_m);
    same.bodies.set_velocity_m_s(0, after.velocity_world_m_s);
    remaining.points = response.remaining_points;
    last_residual_m = response.residual_m;
  }
  EXPECT_LT((squeezed.center_m() - same.center_m()).norm(), 1e-9);
  EXPECT_EQ(squeezed.contact.counters().contacts, 1u);
  EXPECT_EQ(squeezed.contact.counters().still_colliding, 1u);
  EXPECT_EQ(squeezed.contact.counters().unrecovered, 0u);
  EXPECT_EQ(squeezed.contact.last_query().count, 1u);
  EXPECT_EQ(squeezed.contact.last_query().deepest_m, last_residual_m) << "after the fourth move";
  EXPECT_GT(last_residual_m, 0);
  squeezed.contact.after_step();
  EXPECT_EQ(squeezed.contact.counters().contacts, 2u);
  EXPECT_EQ(squeezed.contact.counters().still_colliding, 2u);
}

TEST(RigidContact, ContactWithoutAnExitIsCountedAndMovesNothing) {
  const auto silhouettes = seen({ball(kOrigin, 0.15)});
  Contacts enclosed({virtual_ball(kOrigin)}, silhouettes);
  enclosed.bodies.set_velocity_m_s(0, {0, 0, -1});
  for (std::uint64_t query = 1; query <= 2; ++query) {
    enclosed.contact.after_step();
    EXPECT_EQ(enclosed.contact.counters().contacts, query);
    EXPECT_EQ(enclosed.contact.counters().unrecovered, query);
    EXPECT_EQ(enclosed.contact.counters().still_colliding, 0u);
  }
  EXPECT_EQ(enclosed.center_m(), kOrigin);
  EXPECT_EQ(enclosed.bodies.velocity_m_s(0), Vector3d(0, 0, -1));
  EXPECT_EQ(enclosed.contact.take_contact(0)->response.status,
            collision::RecoveryStatus::reference_inside);
}

TEST(CurrentHull, RequeryDetectsTheMovedObject) {
  const auto silhouettes = bars({bar(0)});
  config::SceneObject box = virtual_box("box", {0.02, 0, 0.03}, {0.1, 0.1, 0.1});
  Contacts at_start({box}, silhouettes);
  const Vector3d move_m(0.02, 0.04, 0.01);
  collision::DetectionObject object = sim::detection_object(at_start.models, at_start.bodies, 0);
  const collision::ObjectCollision found = at_start.hull.requery(object)(move_m);
  object.world_from_object.translation() += move_m;
  object.rp_object_world_m += move_m;
  const collision::ObjectCollision expected = at_start.hull.detect({&object, 1})[0];
  EXPECT_TRUE(expected.colliding());
  EXPECT_EQ(found.verdict, expected.verdict);
  EXPECT_EQ(found.triangles, expected.triangles);
  EXPECT_EQ(found.points, expected.points);
}

TEST(RigidContact, ConcernsOnlyTheObjectsThatTouch) {
  const auto silhouettes = bars({bar(0)});
  Contacts three({virtual_ball({0, 0, 0.2}), virtual_box("box", {0, 0, 0}, {0.1, 0.1, 0.1}),
                  virtual_ball({0, 0, 0.085}), virtual_ball({0, 0.02, 0.084})},
                 silhouettes);
  three.contact.after_step();
  EXPECT_FALSE(three.contact.take_contact(0));
  EXPECT_FALSE(three.contact.take_contact(1)) << "it does not bounce";
  for (const std::size_t touching : {2u, 3u}) {
    const auto contact = three.contact.take_contact(touching);
    ASSERT_TRUE(contact) << touching;
    EXPECT_EQ(contact->object.rp_object_world_m,
              three.scene.objects[touching].world_from_object.translation());
    EXPECT_GT(three.bodies.center_world_m(touching).z(), 0.0855) << "out of the hull";
  }
  EXPECT_EQ(three.center_m(), Vector3d(0, 0, 0.2));
  EXPECT_EQ(three.contact.counters().contacts, 2u);
}

}  // namespace
}  // namespace fivepipe::test
